"""Descriptions: mechanisms, tasks and problem files as frozen values, no computation."""
