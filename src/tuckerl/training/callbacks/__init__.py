"""What is called while a learner learns."""
