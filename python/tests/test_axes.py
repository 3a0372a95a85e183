"""The operators of several axes of one recording, as `hoid identify --pair`."""

import pyhoid
import pytest


def flight() -> pyhoid.Record:
    """Two simulated people as the two axes of one recording."""
    x, y = (pyhoid.simulate("C1", seed=seed) for seed in (1, 2))
    return pyhoid.Record(
        e=x.e,
        u=x.u,
        sample_time=x.sample_time,
        rx=x["f_t"],
        ey=y.e,
        uy=y.u,
        ry=y["f_t"],
    )


def test_each_axis_has_its_operator_and_its_couplings() -> None:
    record = flight()
    axes = pyhoid.identify_axes(record, [("e", "u", "rx"), ("ey", "uy", "ry")])
    assert [(axis.input, axis.output, axis.excitation) for axis in axes] == [
        ("e", "u", "rx"),
        ("ey", "uy", "ry"),
    ]
    for axis in axes:
        tau = axis.fit.parameters["tau_e"]
        assert abs(tau.value - 0.28) < 4 * tau.standard_error
        (coupling,) = axis.couplings
        # Both targets have the same lines, so that a coupling cannot be separated from the response.
        assert coupling.p_value is None and not coupling.responds
        assert "share the line" in coupling.reason
    alone = pyhoid.identify(record.with_signals("ey", "uy"), excitation="ry")
    assert axes[1].fit.parameters["tau_e"].value == alone.parameters["tau_e"].value


def test_mistakes_are_named() -> None:
    record = flight()
    with pytest.raises(pyhoid.OptionError, match="two or more"):
        pyhoid.identify_axes(record, [("e", "u")])
    with pytest.raises(pyhoid.DataError, match="no channel uz"):
        pyhoid.identify_axes(record, [("e", "u"), ("ey", "uz")])
    with pytest.raises(pyhoid.OptionError, match="pairs"):
        pyhoid.identify_axes(record, [("e", "u"), ("ey",)])


def test_a_displayed_channel_is_not_left_out_without_a_word() -> None:
    c1 = pyhoid.simulate("C1", seed=1)
    shown = pyhoid.Record(
        e=c1.e, u=c1.u, sample_time=c1.sample_time, f_t=c1["f_t"], roles={"f_t": "feedforward"}
    )
    fit = pyhoid.identify(shown)
    assert fit.verdict.level == "doubtful"
    assert any("display showed f_t (feedforward)" in reason for reason in fit.verdict.reasons)
