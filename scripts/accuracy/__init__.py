"""The measurements behind doc/accuracy.md: each module takes one, tells it as a Markdown table and draws it."""
