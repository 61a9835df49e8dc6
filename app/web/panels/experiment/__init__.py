"""The tab of the experiment log: session, measured values and the table of rows."""
