#!/usr/bin/env python3
"""The common way to fit a machine's circuit to a record: solve_ivp inside least_squares, both of SciPy, with their usual settings.

usage: identify_vs_scipy.py FOLDER R_S R_R L_L L_M [ID...]

FOLDER is a data-set folder as `imrig export` writes it. R_s is held, the other three start at the values given, in ohm and H
of the inverse-gamma circuit; both initial fluxes are unknown. Prints a JSON list with each record's parameters, the error of
its current and the seconds that its fit took (reading is not counted).
"""
import json
import sys
import time
import tomllib

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares
from scipy.signal import lfilter


def read(folder, record, pole_pairs):
    table = np.genfromtxt(f"{folder}/{record['file']}", delimiter=",", names=True)
    v = table["v_alpha_V"] + 1j * table["v_beta_V"]
    i = table["i_alpha_A"] + 1j * table["i_beta_A"]
    return record["sample_time_s"], v, i, pole_pairs * table["speed_rad_s"]


def filtered(i, h, tau):
    """The first-order filter that the voltage channels passed, on the currents (exact for straight lines between samples)."""
    a, r = np.exp(-h / tau), tau / h
    return lfilter([1.0 - r * (1.0 - a), r * (1.0 - a) - a], [1.0, -a], i)


def current(theta, start, t, v, w_r):
    r_s, r_r, l_l, l_m = theta
    h, last = t[1], len(t) - 2

    def derivative(now, psi):
        place = now / h
        k = min(int(place), last)
        part = place - k
        u = v[k] + part * (v[k + 1] - v[k])
        w = w_r[k] + part * (w_r[k + 1] - w_r[k])
        i_s = (psi[0] - psi[1]) / l_l
        return [u - r_s * i_s, r_r * (i_s - psi[1] / l_m) + 1j * w * psi[1]]

    psi = solve_ivp(derivative, (0.0, t[-1]), start, t_eval=t, max_step=h).y
    return (psi[0] - psi[1]) / l_l


def fit(h, v, i, w_r, tau, nominal):
    """All unknowns are scaled to one; no step of the integrator passes over a sample of the voltage."""
    t = h * np.arange(len(v))
    skip = int(8 * tau / h) if tau > 0 else 0
    measured = filtered(i, h, tau) if tau > 0 else i
    w_e = np.angle(np.sum(v[1:] * np.conj(v[:-1]))) / h
    psi_s = (v[0] - nominal[0] * i[0]) / (1j * w_e)
    psi_r = psi_s - nominal[2] * i[0]
    size = abs(psi_s)

    def machine(x):
        theta = (nominal[0], nominal[1] * x[0], nominal[2] * x[1], nominal[3] * x[2])
        return theta, np.array([psi_s + size * (x[3] - 1 + 1j * (x[4] - 1)), psi_r + size * (x[5] - 1 + 1j * (x[6] - 1))])

    def residual(x):
        e = (current(*machine(x), t, v, w_r) - measured)[skip:]
        return np.concatenate([e.real, e.imag])

    found = least_squares(residual, np.ones(7), x_scale="jac", diff_step=1e-3, bounds=([0.1] * 3 + [-1] * 4, [3.0] * 7),
                          ftol=1e-6, xtol=1e-6)
    nrmse = np.sqrt(np.sum(found.fun**2) / np.sum(np.abs(measured[skip:]) ** 2))
    return machine(found.x)[0][1:], nrmse, found.nfev


def main():
    folder, theta, wanted = sys.argv[1], [float(x) for x in sys.argv[2:6]], sys.argv[6:]
    with open(f"{folder}/dataset.toml", "rb") as file:
        manifest = tomllib.load(file)
    out = []
    for record in manifest["record"]:
        if wanted and record["id"] not in wanted:
            continue
        h, v, i, w_r = read(folder, record, manifest["pole_pairs"])
        begin = time.perf_counter()
        (r_r, l_l, l_m), nrmse, evaluations = fit(h, v, i, w_r, record.get("voltage_filter_s", 0.0), theta)
        seconds = time.perf_counter() - begin
        out.append({"id": record["id"], "seconds": seconds, "R_r": r_r, "L_l": l_l, "L_m": l_m, "nrmse": nrmse,
                    "rounds": evaluations, "samples": len(v)})
    print(json.dumps(out))


if __name__ == "__main__":
    main()
