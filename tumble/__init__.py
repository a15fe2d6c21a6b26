"""The application: command line, execution engine, reports."""
