"""Models of the tests of suites and mutants."""

from __future__ import annotations

from ntagen import build


def lamp(most: int = 3) -> build.Model:
    """A lamp with a timer, a person who presses so often, and a location out of reach."""
    model = build.Model(declarations="chan press;\nint count = 0;")
    t = model.template("Lamp", declarations="clock x;")
    off = t.location("Off", initial=True)
    on = t.location("On", invariant="x <= 20")
    broken = t.location("Broken")
    t.edge(off, on, sync="press?", update="x = 0, count = count + 1")
    t.edge(on, off, guard="x >= 20")
    t.edge(on, on, guard=f"x > 5 && count < {most}", sync="press?", update="x = 0 // again")
    t.edge(on, broken, guard="count > 10000")
    person = model.template("Person")
    idle = person.location(initial=True)
    person.edge(idle, idle, guard=f"count < {most}", sync="press!")
    model.system = "system Lamp, Person;"
    model.query("A[] Lamp.x <= 20 || Lamp.Off", expect=True)
    model.query("E<> Lamp.On && Lamp.x > 7", expect=True)
    model.query("A[] not Lamp.Broken", expect=True)
    return model


CODE = """system Lamp, Person;
/** TEST_FILENAME lamp- */
/** TEST_FILEEXT .txt */
/** TEST_PREFIX
begin
*/
/** TEST_POSTFIX
end
*/"""


def lamp_with_code() -> build.Model:
    """The lamp with test code."""
    model = lamp()
    model.system = CODE
    template = model["Lamp"]
    template["Off"].extra.append('<label kind="testcodeEnter">is_off($(count))</label>')
    template["Off"].extra.append('<label kind="testcodeExit">leaves($(count), \\$5)</label>')
    template["On"].extra.append('<label kind="testcodeEnter">is_on($( count ), $(Lamp.x))</label>')
    template.edges[0].extra.append('<label kind="testcode">press($(count))</label>')
    return model
