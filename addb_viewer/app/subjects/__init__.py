"""What all browsers share: the opened folder, each subject with its fits and review, who is here."""
