"""Extracts recordings of the wind farm La Haute Borne, as tables that `trusswatch learn` takes.

    pip download openoa==3.2 --no-deps
    python prepare.py openoa-3.2-py3-none-any.whl

writes the tables beside this file; --from and --to, with --out, any other days. Needs no package.

Data: ENGIE, wind farm La Haute Borne, 2014 and 2015, ten-minute means of four turbines (Senvion MM82), under the Open
Licence 2.0 (Etalab), as shipped with OpenOA 3.2.
"""

import argparse
import csv
import datetime
import io
import zipfile
from pathlib import Path

TURBINES = ["R80711", "R80721", "R80736", "R80790"]
# Wind speed on the nacelle [m/s], outdoor temperature [°C], with the decimals that are kept.
QUANTITIES = {"wind": ("Ws_avg", 2), "temp": ("Ot_avg", 1)}
CHANNELS = [f"{quantity}{turbine[-3:]}" for quantity in QUANTITIES for turbine in TURBINES]
STEP_S = 600
RECORDINGS = {
    "may.csv": ("2014-05-12", "2014-05-17"),
    "june.csv": ("2014-06-21", "2014-06-26"),
    "july.csv": ("2014-07-16", "2014-07-21"),
    "suspect.csv": ("2014-06-06", "2014-06-12"),
}


def measured(package):
    """Of each instant [s since 1970] the readings by channel. `package` is OpenOA's wheel, or the archive in it."""
    with zipfile.ZipFile(package) as outer:
        inner = [name for name in outer.namelist() if name.endswith("la_haute_borne.zip")]
        if inner:
            return measured(io.BytesIO(outer.read(inner[0])))
        (name,) = [name for name in outer.namelist() if name.endswith("la-haute-borne-data-2014-2015.csv")]
        readings = {}
        with outer.open(name) as table:
            for row in csv.DictReader(io.TextIOWrapper(table)):
                instant = int(datetime.datetime.fromisoformat(row["Date_time"]).timestamp())
                of_instant = readings.setdefault(instant, {})
                for quantity, (column, decimals) in QUANTITIES.items():
                    cell = row[column]
                    reading = round(float(cell), decimals) if cell else ""
                    # Some instants are given twice.
                    of_instant.setdefault(f"{quantity}{row['Wind_turbine_name'][-3:]}", reading)
    return readings


def write(readings, begin, end, file):
    """Writes the days from `begin` to the one before `end` (UTC)."""
    first, last = (int(datetime.datetime.fromisoformat(f"{day}T00:00+00:00").timestamp()) for day in (begin, end))
    with open(file, "w", newline="") as table:
        rows = csv.writer(table, lineterminator="\n")
        rows.writerow(["time", *CHANNELS])
        for instant in range(first, last, STEP_S):
            time = datetime.datetime.fromtimestamp(instant, datetime.timezone.utc)
            of_instant = readings.get(instant, {})
            rows.writerow([f"{time:%Y-%m-%d %H:%M}", *(of_instant.get(channel, "") for channel in CHANNELS)])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("package", type=Path, help="OpenOA's wheel, or la_haute_borne.zip")
    parser.add_argument("--from", dest="begin", metavar="DAY")
    parser.add_argument("--to", dest="end", metavar="DAY")
    parser.add_argument("--out", type=Path, metavar="FILE")
    given = parser.parse_args()
    found = measured(given.package)
    if given.out:
        write(found, given.begin, given.end, given.out)
    else:
        for file_name, (begin, end) in RECORDINGS.items():
            write(found, begin, end, Path(__file__).parent / file_name)
