"""The command line. Modules are imported where they are needed: `duocell version` should not load solvers."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from duocell.service.cli.exit_codes import Exit
from duocell.service.exports.exports import EXPORTS

if TYPE_CHECKING:
    from duocell.service.cli.input import RobotUrdfs


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; returns its exit code."""
    options = parser().parse_args(arguments)
    command: Callable[[argparse.Namespace], int] = options.command
    try:
        return int(command(options))
    except KeyboardInterrupt:
        sys.stderr.write("interrupted\n")
        return Exit.INTERRUPTED
    except BrokenPipeError:  # `duocell robots | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return Exit.FAILED


def parser() -> argparse.ArgumentParser:
    """The grammar of the command line."""
    top = argparse.ArgumentParser(
        prog="duocell",
        description="Finds where to bolt down the arms of a workcell.",
        epilog="exit codes: 0 solved (optimal, or feasible and searched to the end), 1 failed, 2 bad input, "
        "3 infeasible, 4 feasible but cut by time, 5 unknown, 130 interrupted",
    )
    commands = top.add_subparsers(required=True, metavar="COMMAND")

    serve = commands.add_parser("serve", help="answer requests over HTTP", description="Answer requests over HTTP.")
    serve.add_argument("--host", help="address to listen on (DUOCELL_HOST, default 127.0.0.1)")
    serve.add_argument("--port", type=int, help="port to listen on, 0: a free one (DUOCELL_PORT, default 8000)")
    serve.add_argument("--workers", type=int, help="solves at the same time (DUOCELL_WORKERS, default: one per core)")
    serve.add_argument("--data-dir", type=Path, help="folder for what has to survive a restart (DUOCELL_DATA_DIR)")
    serve.set_defaults(command=_serve)

    migrate = commands.add_parser(
        "migrate",
        help="bring the database up to date",
        description="Make or change the tables of the database to those of this version (DUOCELL_DATABASE_URL, "
        "DUOCELL_DATA_DIR). SQLite is also migrated by `duocell serve`; PostgreSQL only here.",
    )
    migrate.set_defaults(command=_migrate)

    solve = commands.add_parser("solve", help="solve a request", description="Solve a request and print the layout.")
    solve.add_argument("request", metavar="REQUEST.json", help="a body of POST /v1/layouts; - reads standard input")
    solve.add_argument("-o", "--output", metavar="RESULT.json", help="where to write the answer; - is standard output")
    _add_robots(solve)
    solve.add_argument("--time-limit", type=float, metavar="S", help="soft limit in s, in place of that of the request")
    solve.add_argument("--server", metavar="URL", help="solve there instead of here; the key, if any: DUOCELL_API_KEY")
    solve.set_defaults(command=_solve)

    check = commands.add_parser(
        "check",
        help="check a given layout",
        description="Score and verify a layout without optimising: every base stands where the file says.",
    )
    check.add_argument(
        "request",
        metavar="REQUEST.json",
        help="a body of POST /v1/layouts/evaluate, or what `duocell solve -o` wrote; - reads standard input",
    )
    check.add_argument("-o", "--output", metavar="RESULT.json", help="where to write the answer; - is standard output")
    _add_robots(check)
    check.set_defaults(command=_check)

    _add_task(commands)

    robots = commands.add_parser(
        "robots", help="list the robots, or show one", description="List the robots, or show one."
    )
    robots.add_argument("name", nargs="?", metavar="NAME")
    robots.set_defaults(command=_robots)

    figure = commands.add_parser("figure", help="draw a result", description="Draw the floor plan of a result.")
    figure.add_argument("result", metavar="RESULT.json", help="written by `duocell solve -o`, or GET /v1/layouts/{id}")
    figure.add_argument("-o", "--output", metavar="FILE.svg", type=Path, required=True, help=".svg, .pdf or .png")
    _add_robots(figure)
    figure.set_defaults(command=_figure)

    export = commands.add_parser(
        "export",
        help="make a file of a result",
        description="Make a file of a result.",
        epilog="; ".join(f"{each.name}: {each.title}" for each in EXPORTS),
    )
    export.add_argument("result", metavar="RESULT.json", help="written by `duocell solve -o`, or GET /v1/layouts/{id}")
    export.add_argument("name", metavar="NAME", help="what to make: " + ", ".join(each.name for each in EXPORTS))
    export.add_argument("-o", "--output", metavar="FILE", help="where to write it; standard output if left out")
    _add_robots(export)
    export.set_defaults(command=_export)

    key = commands.add_parser("key", help="make an API key", description="API keys of the service.")
    new = key.add_subparsers(required=True, metavar="COMMAND").add_parser(
        "new",
        help="make a key",
        description="Make an API key: its hash line for DUOCELL_API_KEYS_FILE goes to standard output, the key itself, "
        "once, to standard error.",
    )
    new.add_argument("name", metavar="NAME", help="whose key it is; shows up in logs")
    new.set_defaults(command=_new_key)

    version = commands.add_parser("version", help="print the version", description="Print the version.")
    version.set_defaults(command=_version)
    return top


def _add_task(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    task = commands.add_parser(
        "task",
        help="read a task from a table, a robot program or a tool path",
        description="Read a task from a file: CSV, JSON, ROS or MoveIt YAML, programs of Universal Robots, KUKA, ABB "
        "and FANUC, G-code, APT. What is printed goes into a request as it is (docs/tasks.md).",
    )
    task.add_argument("file", metavar="FILE", help="- reads standard input")
    task.add_argument("-o", "--output", metavar="TASK.json", help="where to write the task; left out: standard output")
    task.add_argument("--format", help="what kind of file it is, if neither name nor contents tell")
    task.add_argument("--units", help="of its lengths, if it does not tell: m, mm, cm, inch")
    task.add_argument("--rotation", help="how its orientations are written, if it does not tell")
    task.add_argument("--columns", metavar="X,Y,Z,...", help="names of the columns of a table without names")
    task.add_argument("--tolerance", type=float, metavar="MM", help="leave out way-points within so many mm of the way")
    task.add_argument("--angle-tolerance", type=float, metavar="DEG", help="and within so many degrees (0.57)")
    task.set_defaults(command=_task)


def _add_robots(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--robot-urdf",
        action="append",
        default=[],
        metavar="NAME=FILE[:BASE[:TIP]]",
        help="a robot from a URDF file, to be named NAME in the request; BASE and TIP are links of the file",
    )
    command.add_argument(
        "--missing-meshes",
        choices=("refuse", "estimate"),
        default="refuse",
        help="estimate: the shape of links whose mesh is missing or unreadable is estimated from the kinematics",
    )


def _robot_urdfs(options: argparse.Namespace) -> RobotUrdfs:
    from duocell.service.cli.input import RobotUrdfs

    return RobotUrdfs(tuple(options.robot_urdf), options.missing_meshes)


def _serve(options: argparse.Namespace) -> int:
    from duocell.service.cli.serve import serve

    return serve(host=options.host, port=options.port, workers=options.workers, data_dir=options.data_dir)


def _migrate(options: argparse.Namespace) -> int:
    from duocell.service.cli.migrate import migrate

    return migrate()


def _solve(options: argparse.Namespace) -> int:
    from duocell.service.cli.solve import solve

    return solve(options.request, options.output, _robot_urdfs(options), options.time_limit, options.server)


def _check(options: argparse.Namespace) -> int:
    from duocell.service.cli.check import check

    return check(options.request, options.output, _robot_urdfs(options))


def _task(options: argparse.Namespace) -> int:
    from duocell.service.cli.task import Given, task

    given = Given(
        options.format, options.units, options.rotation, options.columns, options.tolerance, options.angle_tolerance
    )
    return task(options.file, options.output, given)


def _robots(options: argparse.Namespace) -> int:
    from duocell.service.cli.printing.tables import print_robot, print_robots
    from duocell.service.library.library import Library
    from duocell.service.settings import Settings

    library = Library(Settings().data_dir)
    return print_robots(library) if options.name is None else print_robot(options.name, library)


def _figure(options: argparse.Namespace) -> int:
    from duocell.service.cli.solve import figure

    return figure(options.result, options.output, _robot_urdfs(options))


def _export(options: argparse.Namespace) -> int:
    from duocell.service.cli.solve import export

    return export(options.result, options.name, options.output, _robot_urdfs(options))


def _new_key(options: argparse.Namespace) -> int:
    from duocell.service.cli.key import new

    return new(options.name)


def _version(options: argparse.Namespace) -> int:
    from duocell.service.common.version import package_version

    sys.stdout.write(f"duocell {package_version()}\n")
    return Exit.SOLVED


if __name__ == "__main__":
    raise SystemExit(main())
