"""A light, fitted to a face or made to fall on one."""
