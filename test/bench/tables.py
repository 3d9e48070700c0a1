"""Results of `make bench` as numbers, and as tables in Markdown."""

import judge

MEASURES = ["1e-2", "1e-3", "error"]
TITLES = {"1e-2": "Seconds to relMSE 1e-2", "1e-3": "Seconds to relMSE 1e-3", "error": "relMSE after %g s"}


def figures(contender, clock, seconds):
    """What is told of a contender: measure -> (value, mark). Mark "*": extrapolated; "<": at most."""
    points = contender.seconds(clock)
    out = {}
    for measure in ("1e-2", "1e-3"):
        value, beyond = judge.time_to(points, float(measure))
        out[measure] = (value, "*" if beyond else "<" if points and points[0][1] < float(measure) else "")
    value, beyond = judge.error_at(points, seconds)
    out["error"] = (value, "*" if beyond else "")
    return out


def result(row, contenders, clock, seconds):
    """All of a row, for the JSON. Of a renderer's modes the best in each measure counts."""
    out = {"row": row.name, "scene": row.scene, "depth": row.depth, "size": row.size, "renderers": {}, "ratios": {}}
    for c in contenders:
        entry = out["renderers"].setdefault(c.renderer.name, {"pilots": c.pilots, "failure": None, "modes": {}})
        if hasattr(c, "mean"):
            entry.update(mean=c.mean, mean_sigma=c.sigma, reference_error=c.reference_error)
        if c.failure or not c.points:
            entry["failure"] = c.failure
            continue
        entry["modes"][c.mode] = {
            "points": c.points, "fixed_seconds": c.fixed, "figures": figures(c, clock, seconds),
            "samples_per_second": c.points[-1]["spp"] * row.size ** 2 / max(c.points[-1][clock] - c.fixed, 1e-9)}
        entry["figures"] = best_of([mode["figures"] for mode in entry["modes"].values()])
        entry["samples_per_second"] = max(mode["samples_per_second"] for mode in entry["modes"].values())
    ours = out["renderers"][contenders[0].renderer.name].get("figures")
    for measure in MEASURES if ours else []:
        peers = [(e["figures"][measure][0], name) for name, e in out["renderers"].items()
                 if name != contenders[0].renderer.name and "figures" in e and e["figures"][measure][0] is not None]
        if peers and ours[measure][0] is not None:
            best, name = min(peers)
            out["ratios"][measure] = {"best_peer": name, "ratio": ours[measure][0] / best}
    if row.goal and row.goal[0] in out["ratios"]:
        out["goal"] = {"measure": row.goal[0], "ratio": row.goal[1],
                       "met": out["ratios"][row.goal[0]]["ratio"] <= row.goal[1]}
    return out


def best_of(modes):
    return {measure: min((m[measure] for m in modes if m[measure][0] is not None), default=(None, ""))
            for measure in MEASURES}


def ratio_text(ratio):
    return "1/%.3g" % (1 / ratio) if ratio < 1 else "%.3g" % ratio


def table(results, names, measure, seconds):
    title = TITLES[measure] % seconds if "%" in TITLES[measure] else TITLES[measure]
    lines = ["| %s | %s | brume ÷ best peer | goal |" % (title, " | ".join(names)),
             "|---|%s--:|---|" % ("--:|" * len(names))]
    for r in results:
        cells = []
        for name in names:
            entry = r["renderers"].get(name, {})
            if "figures" in entry:
                value, mark = entry["figures"][measure]
                reached = value if measure == "error" else float(measure)
                cells.append("-" if value is None else ("≤ " if mark == "<" else "") + "%.2g" % value +
                             ("*" if mark == "*" else "") + ("~" if entry["reference_error"] > 10 * reached else ""))
            else:
                cells.append("refused" if str(entry.get("failure", "")).startswith("refused") else "failed")
        goal = r.get("goal")
        ratio = r["ratios"].get(measure)
        cells.append("%s (%s)" % (ratio_text(ratio["ratio"]), ratio["best_peer"]) if ratio else "-")
        cells.append("%s: %s" % (ratio_text(goal["ratio"]), "met" if goal["met"] else "missed")
                     if goal and goal["measure"] == measure else "")
        lines.append("| %s | %s |" % (r["row"], " | ".join(cells)))
    return "\n".join(lines)


def speed_table(results, startup, names):
    lines = ["| million samples a second | %s |" % " | ".join(names), "|---|%s" % ("--:|" * len(names))]
    for r in results:
        entries = [r["renderers"].get(name, {}) for name in names]
        lines.append("| %s | %s |" % (r["row"], " | ".join(
            "%.2f" % (e["samples_per_second"] / 1e6) if "samples_per_second" in e else "-" for e in entries)))
    if startup:
        lines.append("| *seconds from process start to the first picture* | %s |" % " | ".join(
            "%.2f" % startup[name] if startup.get(name) else "-" for name in names))
    return "\n".join(lines)
