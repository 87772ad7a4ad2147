"""The file of a certificate is made in pieces, none of which is large."""

import json

from ntagen import checker

COUNTER = """
int[0, 1499] n;
process P() { state A; init A; trans A -> A { guard n < 1499; assign n++; }; }
system P;
"""


def test_the_pieces_are_the_file() -> None:
    model = checker.load(COUNTER)
    answer = model.check("A[] n < 1500", certificate=True)
    pieces = list(answer.certificate_pieces())
    text = "".join(pieces)
    assert text == answer.certificate_text()
    assert [piece.count("\n") for piece in pieces] == [1, 1000, 500]
    assert json.loads(pieces[0])["states"] == answer.certificate_states == 1500
    assert model.verify(text).holds


def test_without_a_certificate_there_is_no_piece() -> None:
    answer = checker.load(COUNTER).check("E<> n == 3")
    assert list(answer.certificate_pieces()) == []
    assert answer.certificate_states is None
    assert answer.certificate_text() is None
