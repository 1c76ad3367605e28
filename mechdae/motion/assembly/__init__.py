"""All poses at one value of the drivers: from the sketch, all assembly modes, what stays open."""
