"""The measured tables of the docs: the command that writes each, how long it takes, and what it depends on.

Tables whose figures no command writes are in `UNWRITTEN`. Tables that come from the code alone are those of
docs/make_tables.py and docs/make_gallery.py.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Measurement:
    """Tables that are measured together."""

    # Its name on the command line; a command that can resume keeps its results in runs/tables/NAME or NAME.kept
    name: str
    commands: tuple[str, ...]  # command lines, run one after the other from the root of the checkout
    minutes: float  # about how long they take together on two cores [min]; a stamp's measured time counts instead
    # Scripts, modules, data and folders of scenarios; the modules that these import are found
    rests_on: tuple[str, ...]
    tables: tuple[str, ...] = ()  # names of the tables in their marks; by default the measurement's own
    # Which figures are times on the clock, which differ with the machine; the measurement then runs alone
    times: str = ""
    cores: int = 1  # how many cores its commands keep busy
    is_study: bool = False  # whether it is a policy study, which `make tables STUDIES=1` measures

    def __post_init__(self) -> None:
        """Name the table."""
        if not self.tables:
            object.__setattr__(self, "tables", (self.name,))


def benchmark(
    name: str,
    minutes: float,
    tables: tuple[str, ...] = (),
    options: str = "",
    *,
    times: str = "",
    more: str = "",
) -> Measurement:
    """A script of benchmarks/ that writes its own tables with ``--docs``."""
    command = f"python benchmarks/{name}.py --docs{options}"
    commands = (command, more) if more else (command,)
    return Measurement(name, commands, minutes, (f"benchmarks/{name}.py",), tables, times)


def study(name: str, minutes: float, tables: tuple[str, ...] = ()) -> Measurement:
    """A study of scenarios/studies."""
    file, folder = f"scenarios/studies/{name}.yaml", f"runs/tables/{name}"
    commands = (f"fogsim study {file} -j 2 --out {folder}", f"python docs/make_study_tables.py {folder}")
    rests_on = (file, "fogsim/cli/study.py", "docs/make_study_tables.py")
    rests_on = (*rests_on, *SIMULATIONS.get(name, ()))
    return Measurement(name, commands, minutes, rests_on, tables, cores=2, is_study=True)


def paper(name: str, minutes: float, *more: str, module: str = "", times: str = "") -> Measurement:
    """Published figures of a paper next to ours, and further tables of its evaluation."""
    tables = (f"paper-{name}", *more)
    command = f"python docs/make_measured_tables.py {' '.join(tables)}"
    return Measurement(name, (command,), minutes, (f"fogsim/reproduce/{module or name}.py",), tables, times)


def environment(
    name: str, minutes: float, tables: tuple[str, ...], options: str, *rests_on: str, cores: int = 1
) -> Measurement:
    """Tables of docs/make_environment_tables.py."""
    command = f"python docs/make_environment_tables.py --ids {options}"
    return Measurement(
        name,
        (command,),
        minutes,
        ("docs/make_environment_tables.py", "envs/fogsim_envs/evaluation.py", "envs/fogsim_envs/task", *rests_on),
        tables,
        cores=cores,
    )


SIMULATIONS = dict.fromkeys(("field_sizes", "message_sign", "motorway_policies"), ("scenarios/studies/motorway",))
"""Folders of studies that run no scenario of the catalogue."""

ACCURACY_KEPT = " --keep runs/tables/estimator_accuracy.kept"
WARNINGS_KEPT = " --keep runs/tables/driver_warnings.kept"
TARGETS_KEPT = " --keep runs/tables/estimator_targets.kept"

POLICIES = tuple(
    f"motorway_policies: {metric}"
    for metric in ("overdriven in fog [m per vehicle-km]", "conflicts per 100 vehicles", "delay [s per vehicle]")
)
NIGHT = ("directions", "veils", "gallen2014", "lobes", "lamps", "glows", "limits")
DEVIATIONS = "benchmarks/night_deviations.py"
AIRLIGHT = "fogsim/reproduce/airlight/__init__.py"
PHOTONS = "tests/data/monte_carlo_surroundings.csv"

MEASUREMENTS = (
    Measurement(
        "night",
        ("python docs/make_measured_tables.py night",),
        1,
        (DEVIATIONS, *(f"tests/data/monte_carlo_{name}.csv" for name in ("veil", "halo", "lobes"))),
        tuple(f"night-{name}" for name in NIGHT),
    ),
    benchmark("paper_methods", 3, ("paper methods",)),
    benchmark("stereo", 1, times="ms"),
    benchmark("belief", 2),
    benchmark("disappearing_vehicles", 2, ("disappearing vehicles",), times="ms"),
    benchmark("night_lamps", 3, ("night lamps",), " --seeds 1"),
    Measurement(
        "night_choices",
        ("python benchmarks/night_lamps.py --choose --docs",),
        2,
        ("benchmarks/night_lamps.py",),
        ("night choices",),
    ),
    benchmark("night_estimators", 5, ("night-estimators",), times="ms"),
    benchmark("night_sources", 5, ("halos",)),
    Measurement(
        "restoration",
        ("OMP_NUM_THREADS=1 python benchmarks/restoration.py --docs",),
        4,
        ("benchmarks/restoration.py",),
        times="ms",
    ),
    benchmark("frames", 2, times="all"),
    benchmark("growth", 4, times="all"),
    Measurement(
        "speed_targets",
        ("python benchmarks/speed_targets.py --docs",),
        12,
        tuple(f"benchmarks/{name}.py" for name in ("speed_targets", "loop", "frames", "traffic", "cold_start")),
        ("speed targets",),
        times="all",
    ),
    benchmark("photograph_roads", 1, ("photographs",)),
    benchmark("camera_kinds", 3, ("camera kinds",), " --images 5"),
    benchmark("sign_estimators", 6, ("sign estimators",), " --drives 12"),
    benchmark("sign_detector", 5, ("sign detector",)),
    benchmark("sensor_faults", 6, ("sensor faults",)),
    benchmark("roadside_cameras", 3, ("roadside cameras",)),
    benchmark("broken_devices", 6, ("broken devices",)),
    benchmark("driver_warnings", 6, ("warnings",), WARNINGS_KEPT),
    benchmark("grades", 6),
    benchmark("uneven_fog", 7, ("uneven fog",)),
    benchmark("lead_accuracy", 4, ("lead accuracy",), times="ms"),
    benchmark("estimator_targets", 3, ("targets",), TARGETS_KEPT),
    benchmark(
        "estimator_accuracy",
        10,
        ("accuracy", "excerpt"),
        ACCURACY_KEPT,
        times="ms",
        more="python docs/make_measured_tables.py excerpt",
    ),
    paper("negru2013", 1, times="time [ms]"),
    paper("zhu2015", 3, "zhu2015"),
    paper("huang2015", 5),
    paper("belaroussi2015", 5),
    paper("gallen2014", 10, module="night/gallen2014"),
    Measurement(
        "drivers",
        ("python docs/make_measured_tables.py drivers",),
        6,
        ("fogsim/reproduce/drivers/__init__.py",),
        ("drivers-published", "drivers-traffic"),
    ),
    benchmark("junctions", 6),
    benchmark("collisions", 8),
    Measurement(
        "airlight",
        (
            "fogsim reproduce airlight --json --out docs/pictures > runs/tables/airlight.kept",
            "python docs/make_airlight_tables.py runs/tables/airlight.kept",
        ),
        10,
        (AIRLIGHT, "docs/make_airlight_tables.py"),
        ("lands", "conditions", "car", "lorry"),
    ),
    benchmark("photon_fog", 6, ("mended",), " --drives 2"),
    Measurement(
        "surroundings", ("python docs/make_airlight_tables.py",), 0.1, (PHOTONS, "docs/make_airlight_tables.py")
    ),
    study("message_sign", 2),  # 80 runs of 2.5 s on one core
    study("motorway_policies", 40, POLICIES),  # 1280 runs of 3.5 s
    study("highway_99", 8),  # 100 runs of 9 s
    study("field_sizes", 10),  # 160 runs of 7 s
    study("which_sensor", 9),  # 140 runs of 4 to 12 s
    study("who_tells_of_the_bank", 7),  # 70 runs of 6 to 27 s
    study("lighting_policies", 14),  # 420 runs of 4 s
    study("estimators_in_the_loop", 12),
    study("night_estimators_in_the_loop", 4),
    environment(
        "advisory",
        5,
        ("returns fogsim/FogAdvisory-v2",),
        "fogsim/FogAdvisory-v2 --episodes 12",
        "fogsim/simulation/loop.py",
        cores=2,
    ),
    environment("advisory_fast", 2, ("returns fogsim/FogAdvisoryFast-v2",), "fogsim/FogAdvisoryFast-v2", cores=2),
    benchmark("surrogate", 5, options=" --episodes 30"),
    benchmark("corridor", 6, ("returns fogsim/FogCorridor-v1",), " --episodes 8"),
)
"""All of them; a round measures the longest first."""


@dataclass(frozen=True, slots=True)
class Unwritten:
    """Tables with figures that no command writes."""

    page: str  # their page
    about: str  # their subject
    figures: str  # the command that prints their figures, or their source


UNWRITTEN = (
    Unwritten("docs/benchmarks/policies.md", "compared with real roads", "from `field_sizes`, by hand"),
    Unwritten("docs/explanation/drivers.md", "who sees what at night", "`fogsim.traffic.drivers`, by hand"),
    Unwritten("docs/explanation/drivers.md", "how far a traffic light is seen", "Allard's law, by hand"),
    Unwritten("docs/explanation/night.md", "sight by low and high beams", "`fogsim.lighting.own_sight`, by hand"),
    Unwritten("docs/explanation/physics.md", "how roads reflect", "`python tools/make_road_reflectance.py`"),
    Unwritten("docs/reference/environments.md", "returns beside thresholds", "`fogsim_envs.evaluate`, by hand"),
    Unwritten("docs/reference/environments.md", "what an agent learned", "`python examples/train_agent.py`"),
)
"""Tables of figures that are written by hand."""
