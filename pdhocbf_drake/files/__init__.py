"""Files and folders that are complete or not there, and that replace nothing but what they are made to replace."""
