"""Arguments of commands: recognise their kind by content, describe them, make a run of them."""
