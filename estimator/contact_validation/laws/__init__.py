"""The laws of contact that impacts are compared with."""
