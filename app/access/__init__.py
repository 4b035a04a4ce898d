"""People: who may see and change what. Sign-in, sessions, roles, and the keys that programs call with."""
