"""Files of others: bounded reading, and the formats of scenes, images and arms."""
