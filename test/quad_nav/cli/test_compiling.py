"""Kernels are compiled before the clock of a flight starts, and a line says so."""

from __future__ import annotations

import threading

from click.testing import CliRunner

from quad_nav.cli import main, offline_flight, progress
from quad_nav.files import kernel_cache

PATIENCE_S = 60.0


def test_what_takes_long_is_announced(monkeypatch, capsys):
    announced = threading.Event()
    monkeypatch.setattr(kernel_cache, "_LONG_S", 0.0)
    monkeypatch.setattr(progress, "simulate", lambda: announced.wait(PATIENCE_S))
    echo = progress.echo
    monkeypatch.setattr(progress, "echo", lambda text, err: (echo(text, err=err), announced.set()))
    progress.compile_kernels([], quiet=False)
    assert capsys.readouterr().err == kernel_cache.COMPILING + "\n"


def test_what_is_quick_is_not(monkeypatch, capsys):
    monkeypatch.setattr(progress, "simulate", lambda: None)
    progress.compile_kernels([], quiet=False)
    assert capsys.readouterr().err == ""


def test_a_flight_has_its_kernels_before_it_begins(monkeypatch):
    order = []
    fly = offline_flight.fly_setup
    monkeypatch.setattr(progress, "simulate", lambda: order.append("simulate"))
    monkeypatch.setattr(progress, "warm_up", lambda _: order.append("warm up"))
    monkeypatch.setattr(
        offline_flight, "fly_setup", lambda *given: (order.append("fly"), fly(*given))[1]
    )
    done = CliRunner().invoke(main, ["fly", "-q", "--time-limit", "0.1"])
    assert done.exit_code == 1, done.output
    assert order == ["simulate", "warm up", "fly"]


def test_ctrl_c_while_compiling_is_an_interruption(monkeypatch):
    def interrupt():
        raise KeyboardInterrupt

    monkeypatch.setattr(progress, "simulate", interrupt)
    assert CliRunner().invoke(main, ["fly", "-q"]).exit_code == 130
