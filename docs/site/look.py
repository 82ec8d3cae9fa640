"""Whether pages fit a laptop and a phone: python docs/site/look.py SITE [PICTURES PAGE...]

Every page of a built site is laid out by chromium at both widths; those that are wider than their
window are named, with exit code 1. PAGES, such as index.html, are drawn into the folder PICTURES.
"""

import json
import re
import subprocess
import sys
import tempfile
from html import unescape
from pathlib import Path

WIDTHS = 1400, 390  # px
HEIGHT = 1600
ASK = """<!doctype html><body><script>
(async () => {
  const wide = [];
  for (const page of PAGES) for (const width of WIDTHS) {
    const frame = document.createElement("iframe");
    frame.style = `border: 0; width: ${width}px; height: 900px`;
    await new Promise(done => {
      frame.onload = done; frame.src = page; document.body.append(frame);
    });
    const found = frame.contentDocument.documentElement.scrollWidth;
    if (found > width) wide.push([page, width, found]);
    frame.remove();
  }
  document.body.innerHTML = "<pre></pre>";
  document.querySelector("pre").textContent = JSON.stringify(wide);
})()
</script>"""
DRAW = '<body style="margin: 0"><iframe src="{}" style="border: 0; width: {}px; height: {}px">'


def too_wide(site: Path) -> list[tuple[str, int, int]]:
    """(page, width of the window, width of the page), px, of each page that does not fit."""
    pages = {path.resolve().as_uri(): path for path in sorted(site.rglob("*.html"))}
    ask = ASK.replace("PAGES", json.dumps(list(pages))).replace("WIDTHS", json.dumps(WIDTHS))
    told = _chromium(ask, "--virtual-time-budget=100000000", "--dump-dom")
    answer = re.search("<pre>(.*)</pre>", told, re.DOTALL)
    assert answer, told[-2000:]
    found = json.loads(unescape(answer[1]))
    return [(str(pages[page].relative_to(site)), width, wide) for page, width, wide in found]


def draw(page: Path, picture: Path, width: int) -> None:
    """The upper part of a page at a width."""
    frame = DRAW.format(page.resolve().as_uri(), width, HEIGHT)
    size = f"--window-size={max(width, 500)},{HEIGHT}"  # a window itself has at least 500 px
    _chromium(frame, size, "--virtual-time-budget=10000", f"--screenshot={picture.resolve()}")


def _chromium(html: str, *options: str) -> str:
    """What chromium prints of a page that may read files."""
    with tempfile.TemporaryDirectory() as aside:
        page = Path(aside) / "ask.html"
        page.write_text(html, encoding="utf-8")
        fixed = ["--headless", "--no-sandbox", "--disable-gpu", "--allow-file-access-from-files"]
        fixed += ["--hide-scrollbars", f"--user-data-dir={aside}/profile"]
        command = ["chromium", *fixed, *options, page.as_uri()]
        return subprocess.run(command, capture_output=True, text=True, timeout=1200).stdout


def main(site: str, pictures: str = "", *pages: str) -> int:
    """Names and draws; 1 where a page does not fit."""
    for page in pages:
        Path(pictures).mkdir(parents=True, exist_ok=True)
        for width in WIDTHS:
            name = page.replace("/", "-").removesuffix(".html")
            draw(Path(site) / page, Path(pictures) / f"{name}-{width}.png", width)
    wide = too_wide(Path(site))
    for page, width, found in wide:
        print(f"{page}: {found} px wide in a window of {width}")
    return bool(wide)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
