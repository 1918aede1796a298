"""The report as one HTML page that needs nothing else."""

import base64
import html
import mimetypes
import pathlib

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; max-width: 1100px; margin: 2em auto; padding: 0 1em; }
table { border-collapse: collapse; margin: 1em 0; font-size: 13px; }
td, th { border-bottom: 1px solid #ccc; padding: 2px 8px; text-align: right; }
td:first-child, th:first-child { text-align: left; }
img { max-width: 100%; }
caption { text-align: left; font-weight: 600; padding: 4px 0; }
details { margin: 1em 0; }
"""


class Page:
    def __init__(self, title):
        self.title = title
        self.parts = [f"<h1>{html.escape(title)}</h1>"]

    def heading(self, text):
        self.parts.append(f"<h2>{html.escape(text)}</h2>")

    def paragraph(self, text):
        self.parts.append(f"<p>{html.escape(text)}</p>")

    def table(self, names, rows, caption=""):
        def line(cells, tag):
            inner = "".join(f"<{tag}>{html.escape(str(c))}</{tag}>" for c in cells)
            return f"<tr>{inner}</tr>"

        head = f"<caption>{html.escape(caption)}</caption>" if caption else ""
        body = "\n".join(line(row, "td") for row in rows)
        self.parts.append(f"<table>{head}{line(names, 'th')}\n{body}</table>")

    def picture(self, path, text=""):
        path = pathlib.Path(path)
        kind = mimetypes.guess_type(path.name)[0]
        data = base64.b64encode(path.read_bytes()).decode()
        self.parts.append(f'<p><img alt="{html.escape(text)}" src="data:{kind};base64,{data}"></p>')

    def write(self, path):
        body = "\n".join(self.parts)
        title = html.escape(self.title)
        pathlib.Path(path).write_text(
            f"<!doctype html>\n<html lang=en><head><meta charset=utf-8><title>{title}</title>"
            f"<style>{STYLE}</style></head>\n<body>\n{body}\n</body></html>\n",
            encoding="utf-8",
        )
