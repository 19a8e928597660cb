# SPDX-License-Identifier: Apache-2.0
"""Lines for every command and argument of a daemon, drawn from its own help: at, just inside and
just beyond each limit, and nonsense."""
import re

NONSENSE = (
    "nan", "inf", "-inf", "infinity", "1e308", "-1e308", "1e-320", "9" * 20, "-" + "9" * 20, "9" * 400,
    "0." + "0" * 30 + "1", "-0", "+", "-", "--", ".", "", "0x", "0xFFFFFFFFFFFFFFFFFF", "1,5", "1/0", "0/0",
    "1/100", "1/3 s", "5 mm", "5mm", "1.8 m", "1e3 m", "f/", "f/0", "f/8", "x", "5x", "mm", "٣", "½", "²",
    "\u202e1", "\x01", "\x7f", "\x1b[2J", "%s%n%d", "..", "../..", "./.", ".part", "~", "*", "$HOME",
    "\\", "\\\"", "'", "=", "a=b", ",", ",,,", ":", "1:", ":1", "1:2", "2:1", "1x1", "1,2,3", "0,0,0,0",
    "1,1,1,1", "10,10,2,2", "0,0,65535,65535", "né", "名前", "\udcff\udcfe", "A" * 400, "é" * 200)
SENSIBLE = ("status", "pan 1", "one", "two", "start", "4", "left", "zoom", "300:1:1:1", "rig.mains", "AAAA",
            "0badcafe", "127.0.0.1:1/x")
SMALL_PX = ((1, 1), (2, 2), (7, 64), (8, 8), (64, 15), (16, 16), (31, 31), (32, 32), (64, 64))
NUMBER = r"(-?\d+(?:\.\d+)?)"


class Argument:
    """What help says of an argument. Text that is not understood is an error: no kind goes untried."""

    def __init__(self, name, said):
        self.name, self.expected = name, said["expected"]
        self.is_option = name[0].islower()
        self.optional = said.get("optional") == "yes"
        self.limits, self.words, self.count, self.separator = None, [], 1, ""
        rest = self.expected
        if form := re.match(r"([A-Z]+)([^A-Z,]|,(?! ))[A-Z](\S*), (?=integers|numbers)", rest):
            self.separator = form[2]
            self.count = form[0].count(self.separator) + 1 - (self.separator == ",")
            rest = rest[form.end():]
        self.whole = bool(re.match("(an )?integer", rest))
        if found := re.match(rf"(?:an? )?(?:integers?|numbers?) from {NUMBER} to {NUMBER}", rest):
            self.kind, self.limits = "number", (float(found[1]), float(found[2]))
        elif found := re.match(rf"(?:a )?numbers? of at least {NUMBER}", rest):
            self.kind, self.limits = "number", (float(found[1]), float("inf"))
        elif found := re.fullmatch(r"text of (\d+)(?: to (\d+))? characters", rest):
            self.kind, self.limits = "text", (int(found[1]), int(found[2] or found[1]))
        elif re.fullmatch(r"[\w-]+(, [\w-]+)*( or [\w-]+)?", rest):
            self.kind, self.words = "choice", re.split(", | or ", rest)
        else:
            raise AssertionError(f"{name}: what is {self.expected!r}?")

    def number(self, value):
        """As a person writes it."""
        if value == float("inf"):
            return "inf"
        return f"{value:.0f}" if value == round(value) else f"{value:.6f}".rstrip("0")

    def parts(self):
        """Pairs of a number and whether it is within the limits."""
        low, high = self.limits
        step = 1 if self.whole else 1e-4
        inside = [low, low + step]
        if high < float("inf"):
            inside += [high, high - step, (low + high) // 2, low + (high - low) // 100]
        else:
            inside += [low + 1000, high]
        outside = [low - step, low - 1e6]
        outside += [high + step, high * 10 + 1] if high < float("inf") else []
        return ([(self.number(value), True) for value in inside],
                [(self.number(value), False) for value in outside])

    def values(self):
        """Pairs of a text and whether it is within the limits, or None: not said."""
        if self.kind == "choice":
            return [(word, True) for word in self.words] + [("neither", False),
                                                            (self.words[0].upper(), False)]
        if self.kind == "text":
            low, high = self.limits
            return [("a" * length, low <= length <= high)
                    for length in (low, low + 1, high - 1, high, high + 1) if 0 <= length <= 480] + [
                        ("é" * (high // 2), None), ("", low == 0)]
        inside, outside = self.parts()
        if self.count == 1:
            return inside + outside
        whole = [(self.separator.join([text] * self.count), good) for text, good in inside + outside]
        mixed = [(self.separator.join(out if i == at else inside[2][0] for i in range(self.count)), False)
                 for at in range(self.count) for out, _ in outside]
        if self.count == 4:  # small regions inside the picture
            mixed += [(self.separator.join(("10", "10", str(wide), str(high))), None)
                      for wide, high in SMALL_PX]
        return whole + mixed + [(self.separator.join([inside[0][0]] * (self.count - 1)), False)]

    def word(self, text):
        """The argument on the line; quotes where they are needed."""
        if text == "" or re.search(r'[\s"\\#=]', text) or text.startswith("-"):
            text = '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
        return f"{self.name}={text}" if self.is_option else text


class Line:
    """`good`: whether its one value that was tried is within the limits; None: not said."""

    def __init__(self, command, text, good=None):
        self.command, self.text, self.good = command, text, good


class Commands:
    def __init__(self, ask_json, chance):
        """`ask_json` returns the answer to a line."""
        self.chance, self.arguments = chance, {}
        for name in (name for group in ask_json("help")["result"].values() for name in group):
            said = ask_json(f"help {name}")["result"]
            self.arguments[name] = [Argument(key, value) for key, value in said.items()
                                    if isinstance(value, dict)]

    def usual(self, argument):
        """A value within the limits, rather a small one."""
        good = [text for text, fits in argument.values() if fits]
        if argument.kind == "text" and self.chance.random() < 0.8:
            low, high = argument.limits
            good = [text for text in SENSIBLE if low <= len(text) <= high] or good
        return self.chance.choice(good)

    def line(self, name, tried, text):
        """A line with this text for one argument, and what else the command requires."""
        words = [name]
        before = True
        for argument in self.arguments[name]:
            if argument is tried:
                words.append(argument.word(text))
                before = before and argument.is_option
            elif not argument.is_option and (before and tried is not None and not tried.is_option
                                             or not argument.optional):
                words.append(argument.word(self.usual(argument)))
        return " ".join(words)

    def at_limits(self):
        """All lines with one argument at, inside or beyond its limits, or nonsense."""
        lines = [Line(name, name) for name in self.arguments]
        for name, arguments in self.arguments.items():
            for argument in arguments:
                lines += [Line(name, self.line(name, argument, text), good)
                          for text, good in argument.values()]
        return lines

    def random(self):
        """A line with several arguments, each with any value, in some order."""
        name = self.chance.choice(list(self.arguments))
        words = []
        for argument in self.arguments[name]:
            if self.chance.random() < (0.3 if argument.optional else 0.95):
                strange = self.chance.random() < 0.4
                text = self.chance.choice(NONSENSE) if strange else self.usual(argument)
                words.append(argument.word(text))
        if self.chance.random() < 0.1:
            self.chance.shuffle(words)
            words.append(self.chance.choice(NONSENSE))
        if self.chance.random() < 0.02:
            words.append("x" * self.chance.choice((500, 5000, 20000)))
        return Line(name, " ".join([name, *words]))
