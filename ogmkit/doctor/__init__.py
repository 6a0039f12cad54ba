"""What this installation has, and what it lacks for what: for people, and for reports of bugs."""
