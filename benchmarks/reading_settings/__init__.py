"""What settings of reading decide, on recordings that are changed beforehand."""
