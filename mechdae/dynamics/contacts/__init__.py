"""Contacts of joints in motions: stops that are hit, and gaps that are crossed."""
