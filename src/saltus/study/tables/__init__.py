"""What a study file may hold, read strictly: no more than texts and numbers, nothing computed."""
