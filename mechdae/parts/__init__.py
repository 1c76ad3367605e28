"""What only some users ask for; each part adds itself, and no other room names one."""
