"""The measurements behind doc/accuracy.md. Each module measures one thing, and returns it as a Markdown table and as a figure."""
