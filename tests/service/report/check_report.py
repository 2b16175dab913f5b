#!/usr/bin/env python3
"""check_report.py <skylight_report_sample> <folder>: writes the samples and reads every file with another parser."""
import csv
import json
import math
import pathlib
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET

SVG = "{http://www.w3.org/2000/svg}"
HTML = "{http://www.w3.org/1999/xhtml}"
# Elements that run something or fetch something.
FORBIDDEN = {"script", "iframe", "object", "embed", "link", "img", "image", "base", "form", "foreignObject", "use"}
errors = []


def expect(condition, what):
    if not condition:
        errors.append(what)


def parse(path):
    try:
        return ET.parse(path).getroot()
    except ET.ParseError as error:
        errors.append(f"{path}: {error}")
        return None


def check_nothing_from_outside(root, name):
    for element in root.iter():
        tag = element.tag.split("}")[-1]
        expect(tag not in FORBIDDEN, f"{name}: <{tag}>")
        for key, value in element.attrib.items():
            expect(not key.lower().startswith("on"), f"{name}: <{tag} {key}>")
            if key.split("}")[-1] in ("href", "src"):
                expect(re.fullmatch(r"#[a-z0-9_-]+|(tables|plots)/[a-z0-9_-]+\.csv", value), f"{name}: {key}={value}")
        if tag == "style":
            expect("url(" not in element.text and "@import" not in element.text, f"{name}: a style that fetches")


def check_ids(root, name):
    ids = [element.get("id") for element in root.iter() if element.get("id")]
    expect(len(ids) == len(set(ids)), f"{name}: an id is there twice")
    for element in root.iter():
        for words in (element.get("aria-labelledby"), (element.get("href") or "").removeprefix("#")):
            if words and not words.endswith(".csv"):
                for word in words.split():
                    expect(word in ids, f"{name}: nothing has the id {word}")
        clip = re.fullmatch(r"url\(#(.*)\)", element.get("clip-path") or "url(#)").group(1)
        expect(not clip or clip in ids, f"{name}: nothing has the id {clip}")


def check_svg(svg, name):
    expect(svg.tag == SVG + "svg" and svg.get("role") == "img", f"{name}: not a picture")
    children = list(svg)
    expect(children[0].tag == SVG + "title" and children[1].tag == SVG + "desc", f"{name}: no title and description")
    width, height = map(float, svg.get("viewBox").split()[2:])
    expect(100 < width <= 820 and 100 < height < 1500, f"{name}: {width} x {height}")
    for element in svg.iter():
        for key, value in element.attrib.items():
            if key in ("d", "x", "y", "width", "height", "viewBox", "transform", "font-size", "stroke-width"):
                expect(not re.search(r"nan|inf|[0-9]e[+-]?[0-9]", value, re.I), f"{name}: {key}={value[:80]}")
        if element.tag == SVG + "path":
            expect(re.fullmatch(r"(?:[MLHVhvlmz][-0-9., ]*)+", element.get("d")), f"{name}: d={element.get('d')[:80]}")


def check_page(page, name):
    for table in page.iter(HTML + "table"):
        expect(list(table)[0].tag == HTML + "caption", f"{name}: a table without caption")
        for cell in table.iter(HTML + "th"):
            expect(cell.get("scope") in ("col", "colgroup", "row"), f"{name}: a heading without scope")
        body = table.find(HTML + "tbody")
        widths = {len(list(row)) for row in body}
        expect(len(widths) <= 1, f"{name}: rows of {widths} cells")
        columns = [[0], [0]]
        for row, count in zip(table.find(HTML + "thead"), columns):
            for cell in row:
                span = int(cell.get("colspan", 1))
                columns[0][0] += span if row is table.find(HTML + "thead")[0] else 0
        expect(not widths or columns[0][0] in widths, f"{name}: {columns[0][0]} headings over {widths} cells")
    linked = {a.get("href") for a in page.find(f".//{HTML}nav").iter(HTML + "a")}
    sections = {"#" + s.get("aria-labelledby") for s in page.iter(HTML + "section")}
    expect(linked == sections, f"{name}: contents {linked ^ sections}")


def same(text, value):
    """A field of a CSV file against JSON's value; JSON has no infinities."""
    if value is None:
        return text == "" or not math.isfinite(float(text))
    if isinstance(value, str):
        return text == value
    return float(text) == value


def check_numbers(folder, blocks):
    for block in blocks:
        if block["kind"] == "gallery":
            check_numbers(folder, block["plots"])
        if block["kind"] == "table":
            path = folder / "tables" / (block["id"] + ".csv")
            rows = list(csv.reader(path.open(newline="", encoding="utf-8"), strict=True))
            expect(len(rows) == 1 + len(block["rows"]), f"{path}: {len(rows)} lines")
            for texts, values in zip(rows[1:], block["rows"]):
                expect(len(texts) == len(values) and all(map(same, texts, values)), f"{path}: {texts} is not {values}")
        if block["kind"] == "plot":
            check_plot_numbers(folder / "plots" / (block["id"] + ".csv"), block)


def check_plot_numbers(path, plot):
    rows = list(csv.DictReader(path.open(newline="", encoding="utf-8"), strict=True))
    expected = []
    names = plot.get("x_names", [])
    for series in plot["series"]:
        for i, x in enumerate(series["x"]):
            named = x is not None and x == int(x) and 0 <= x < len(names) if x is None or abs(x) < 1e9 else False
            rest = [series[key][i] if i < len(series.get(key, [])) else None for key in ("y", "low", "high")]
            expected.append([series["name"], names[int(x)] if named else x] + rest)
    expect(len(rows) == len(expected), f"{path}: {len(rows)} lines, not {len(expected)}")
    for row, values in zip(rows, expected):
        expect(all(map(same, row.values(), values)), f"{path}: {list(row.values())} is not {values}")


def check_folder(folder):
    page = parse(folder / "report.html")
    if page is None:
        return
    check_nothing_from_outside(page, "report.html")
    check_ids(page, "report.html")
    check_page(page, "report.html")
    for svg in page.iter(SVG + "svg"):
        check_svg(svg, "report.html")
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    for section in report["sections"]:
        check_numbers(folder, section["blocks"])
    pictures = sorted((folder / "plots").glob("*.svg"))
    expect(len(pictures) > 5, f"{folder}: {len(pictures)} pictures")
    for path in pictures:
        svg = parse(path)
        if svg is not None:
            check_nothing_from_outside(svg, path)
            check_ids(svg, path)
            check_svg(svg, path)
    expect(not list(folder.rglob("*.part")), f"{folder}: drafts are left")


def main():
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    shutil.rmtree(folder, ignore_errors=True)
    subprocess.run([program, str(folder)], check=True)
    check_folder(folder)
    check_folder(folder / "hostile")
    size = (folder / "report.html").stat().st_size
    expect(size < 1_500_000, f"report.html has {size} bytes")
    for error in errors[:20]:
        print(error)
    print(f"{len(errors)} errors")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
