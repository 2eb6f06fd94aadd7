"""What the verbs of the command line measure: certificates, pushes, campaigns, the paper's results, speed."""
