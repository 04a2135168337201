"""Check raw and processed traces and collect the reasons for rejection."""
