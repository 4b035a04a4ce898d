"""Warnings that stop a program text: their sentences, and who acknowledged them, when and why."""
