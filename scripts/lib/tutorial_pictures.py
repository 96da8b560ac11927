#!/usr/bin/env python3
"""Pictures of docs/missing-effect.md from what the tutorial's commands left behind; drawn by gnuplot.
usage: tutorial_pictures.py FOLDER_OF_THE_TUTORIAL FOLDER_FOR_SVG"""
import json
import pathlib
import subprocess
import sys

HEAD = """set terminal svg size {size} font 'DejaVu Sans,13' dynamic background '#ffffff'
set output '{out}'
set border 3 lc rgb '#5d6880'
set tics nomirror
set grid ytics lc rgb '#e3e7ee'
set key top right
"""


def asked(*command):
    return json.loads(subprocess.run(["imrig", *command, "--json"], capture_output=True, text=True, check=True).stdout)


def block(name, rows):
    cell = lambda x: "NaN" if x is None else f'"{x}"' if isinstance(x, str) else f"{x:.6g}"
    return f"${name} << EOD\n" + "".join(" ".join(map(cell, row)) + "\n" for row in rows) + "EOD\n"


def draw(out, size, script):
    subprocess.run(["gnuplot"], input=HEAD.format(size=size, out=out) + script, text=True, check=True)
    text = pathlib.Path(out).read_text(encoding="utf-8")
    pathlib.Path(out).write_text("\n".join(line.rstrip() for line in text.splitlines()) + "\n", encoding="utf-8")


def flux_bins(compared):
    psi = next(c for c in compared["maps"][0]["conditions"] if c["condition"] == "psi_Wb")
    return [(f"{b['low']:.2f}-{b['high']:.2f}", 100 * b["channels"]["current_A"]["nrmse"],
             100 * b["channels"]["current_A"]["floor"]) for b in psi["bins"]]


def error_by_flux(before, after, out):
    rows = [(b[0], b[1], a[1], b[2]) for b, a in zip(flux_bins(before), flux_bins(after))]
    draw(out, "760,380", block("d", rows) + """set style data histogram
set style histogram clustered gap 1
set style fill solid border lc rgb 'white'
set logscale y
set ylabel 'current error, % of the signal'
set xlabel 'stator flux, Wb'
set yrange [0.1:100]
plot $d using 2:xtic(1) title 'base model' lc rgb '#e8590c', '' using 3 title 'improved model' lc rgb '#1971c2', \\
  '' using 0:4 with points pt 0 ps 0 notitle, '' using ($0-0.38):4:(0.76):(0) with vectors nohead lw 3 lc rgb '#1d2433' title 'noise floor'
""")


def worst_records(before, after, out):
    script = "set multiplot layout 2,2\nset bmargin 3\nset lmargin 9\n"
    data = ""
    for k, (name, compared) in enumerate((("base model", before), ("improved model", after))):
        kinds = {record["id"]: record["kind"] for record in compared["records"]}
        worst = next(o for o in compared["overlays"] if kinds[o["record"]] == "step")
        rows = [(t, m[0], p[0], m[0] - p[0]) for t, m, p in zip(worst["t_s"], worst["measured_A"], worst["predicted_A"])]
        rows = rows[: max(4, len(rows) * 2 // 5) : 2]
        data += block(f"d{k}", rows)
        script += (f"set title '{name}, its worst step ({worst['record']})' noenhanced\nset ylabel 'i_α, A'\nset yrange [-35:45]\nunset xlabel\n"
                   f"plot $d{k} using 1:2 with lines lw 3 lc rgb '#1d2433' title 'measured', '' using 1:3 with lines lw 1.5 lc rgb '#e8590c' title 'model'\n")
    for k in range(2):
        script += (f"unset title\nset ylabel 'error, A'\nset xlabel 'time, s'\nset yrange [-8:8]\n"
                   f"plot $d{k} using 1:4 with lines lw 1.5 lc rgb '#1971c2' notitle\n")
    draw(out, "980,520", data + script + "unset multiplot\n")


def waterfall(history, compared, out):
    rows = [(h["change"].replace(", ", ",\\n"), 100 * h["fitted_nrmse"], 100 * h["holdout_nrmse"]) for h in history]
    floor, holdout = (100 * compared[part]["floor_nrmse"] for part in ("fitted", "holdout"))
    draw(out, "760,380", block("d", rows) + f"""set style data histogram
set style histogram clustered gap 1.5
set style fill solid border lc rgb 'white'
set boxwidth 0.9
set logscale y
set ylabel 'current error, % of the signal'
set yrange [0.1:100]
set bmargin 5
set xtics noenhanced
plot $d using 2:xtic(1) title 'fitted' lc rgb '#8fb8e3', '' using 3 title 'hold-out' lc rgb '#bfaef2', \\
  {floor:.6g} with lines lw 3 lc rgb '#1971c2' title 'noise floor, fitted', {holdout:.6g} with lines lw 3 lc rgb '#7048e8' title 'noise floor, hold-out'
""")


def shaft_power(before, after, out):
    def rows(compared):
        return [(p["channels"]["output_power_W"]["measured"] / 1000,
                 p["channels"]["output_power_W"]["predicted"] - p["channels"]["output_power_W"]["measured"])
                for p in compared["records"][0]["points"]]
    draw(out, "760,380", block("b", rows(before)) + block("a", rows(after)) + """set ylabel 'shaft power, model less measured, W'
set xlabel 'measured shaft power, kW'
set xzeroaxis lc rgb '#1d2433' lw 2
plot $b with linespoints pt 7 ps 0.6 lw 2 lc rgb '#e8590c' title 'base model', $a with linespoints pt 7 ps 0.6 lw 2 lc rgb '#1971c2' title 'with core loss'
""")


def main():
    work, pictures = map(pathlib.Path, sys.argv[1:])
    pictures.mkdir(parents=True, exist_ok=True)
    before = asked("compare", str(work / "base.toml"), str(work / "bench"))
    after = asked("compare", str(work / "better.toml"), str(work / "bench"))
    error_by_flux(before, after, pictures / "map.svg")
    worst_records(before, after, pictures / "overlay.svg")
    waterfall(asked("model", "history", str(work / "better.toml"))["history"], after, pictures / "waterfall.svg")
    shaft_power(*(asked("compare", str(work / m), "tests/data/motor_18k5") for m in ("motor.toml", "motor_better.toml")),
                pictures / "motor_18k5.svg")


main()
