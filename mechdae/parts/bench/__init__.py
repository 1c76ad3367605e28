"""Speed against error: measured in one run against a closed-form yardstick."""
