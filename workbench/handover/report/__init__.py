"""The report of a design: one page of HTML that says what was asked, what was found and what is proved."""
