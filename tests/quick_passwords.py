"""Argon2 and scrypt at a cost that no installation may have: a run of the tests makes and checks passwords by the thousand.

Replaced in the processes of the tests, never by a setting, so nobody can run a real server like this. With the real cost
tests/access/test_passwords.py and every server that tests start as a program of its own work.
"""

from pwdlib import PasswordHash
from pwdlib.hashers.argon2 import Argon2Hasher

from app.access import passwords

passwords._code_cost = 2
passwords._hashing = PasswordHash((Argon2Hasher(time_cost=1, memory_cost=8, parallelism=1),))
