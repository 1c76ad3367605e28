"""Formulas in four languages, numbers rounded once."""

from __future__ import annotations

import pytest

from mechdae.draw.formulas.notations import escaped, mathml, mathtext, plain, typst
from mechdae.draw.formulas.tree import (
    Column,
    Equation,
    Less,
    Letter,
    Norm,
    Number,
    Product,
    Quotient,
    Sum,
    columns,
    number,
    numbers,
)

V = Letter("v", ("B", "A_3"), "r", vector=True)


def test_letters() -> None:
    assert plain(V) == "v^r_BA3"
    assert mathtext(V) == r"\mathbf{v}_{BA_{3}}^{r}"
    assert "<msubsup>" in mathml(V)
    assert "<mn>3</mn>" in mathml(V)
    assert typst(Letter("P", ("3",), "load")) == '$P_("3")^("load")$'
    assert typst(V) == '$arrow(v)_(B A_("3"))^(r)$'


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (-0.0, "0"),
        (1.0, "1.0000"),
        (-12345.6, "−12346"),
        (1.23456e-7, "1.2346·10⁻⁷"),
        (9.99999, "10.0000"),
        (2.5e9, "2.5000·10⁹"),
    ],
)
def test_five_digits(value: float, text: str) -> None:
    assert plain(number(value)) == text


def test_numbers_of_one_equation_are_rounded_alike() -> None:
    one, other = columns((100.0, 0.001), (2.5, -1e-9), unit="N")
    assert one == Column(("100.00", "0.00"))
    assert other == Column(("2.50", "0.00"), 0, "N")
    assert [own.digits for own in numbers(1e-8, -2e-9)] == ["1.0000", "-0.2000"]


def test_sums_and_products() -> None:
    assert plain(Sum((Number("1"), Number("-2"), Less(Letter("x"))))) == "1 − 2 − x"
    assert plain(Product((Number("2"), Number("-3")))) == "2·(−3)"
    fraction = Quotient(Norm(V), Number("2", 0, "m"))
    assert plain(Equation((Letter("ω"), fraction))) == "ω = |v^r_BA3|/2 m"
    for write in (mathml, typst):
        text = write(Equation((Sum(()), Sum((Number("1"), Number("-2"), Less(V))), fraction)))
        assert "0" in text
        assert "2" in text


def test_words_mean_themselves_in_typst() -> None:
    assert escaped("a_b #let $x$") == r"a\_b \#let \$x\$"
