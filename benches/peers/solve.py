"""Solves one case with one package: `solve.py CASE-FOLDER PACKAGE FORM`; prints one JSON document."""

import importlib
import json
import sys

from case import read_case
from march import NotConverged, cpu_seconds, march


def main():
    folder, package, form = sys.argv[1:4]
    case = read_case(folder)
    begun = cpu_seconds()
    module = importlib.import_module(f"with_{package}")
    imported = cpu_seconds()
    peer = module.Peer(case, form)
    set_up = cpu_seconds()
    peer.warm()
    warm = cpu_seconds()
    document = {
        "package": package,
        "form": form,
        "element": peer.element,
        "solver": peer.solver,
        "versions": peer.versions(),
        "unknowns": int(peer.unknowns),
        "import_cpu_s": imported - begun,
        "set_up_cpu_s": set_up - imported,
        "warm_up_cpu_s": warm - set_up,
    }
    try:
        document |= {"status": "ok"} | march(peer, case)
    except NotConverged as why:
        document |= {"status": "not_converged", "reason": str(why), "cpu_s": cpu_seconds() - warm}
    json.dump(document, sys.stdout)


main()
