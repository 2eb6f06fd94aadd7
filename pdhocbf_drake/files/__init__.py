"""Files and folders of results: complete or not there, through links, and nothing of others touched."""
