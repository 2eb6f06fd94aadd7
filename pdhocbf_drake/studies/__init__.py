"""The measurements of the command line's verbs: certificates, pushes, campaigns, the paper's results, speed."""
