# SPDX-License-Identifier: Apache-2.0
"""Words and phrases that must not come back, and what to write instead. Each is a phrase of translated
English or of a private vocabulary; words with another, technical meaning are not in the list."""
import re


def word(*forms):
    """One of these words, also as a part of an identifier (parts are divided by _ or digits)."""
    return r"(?<![A-Za-z])(?:" + "|".join(forms) + r")(?![A-Za-z])"


# Regular expression, what to write instead. Upper and lower case are the same but for CASE_MATTERS.
PHRASES = (
    (word("told", "tells?"), "report, show, print; is given, is passed"),
    (word("anew"), "again; a new X"),
    (word("whoever"), "the caller, the user, any program that"),
    (r"\bwhatever (?:it|they) (?:is|are|was|were|may be)\b", "any X; delete it"),
    (word("nobody") + r"(?!:|/)", "no client, no caller, no one"),
    (word("somebody"), "a user, a client, another program"),
    (word("troubles?"), "error, last_error; problem, defect"),
    (r"\bthere (?:is|was) no memory\b", "out of memory"),
    (r"\bexpected is\b", "(expected X)"),
    (r"(?<!there )\b(?:is|are|was|were) no (?!longer\b|more\b|less\b|other\b|such\b|different\b|"
     r"better\b|worse\b|larger\b|smaller\b|need\b)[a-z]+", "is not a X; invalid X"),
    (word("hungry"), "feed_is_due, waiting for input"),
    (word("deaf"), "input_paused"),
    (word("welcome"), "allowed, accepted"),
    (word("lack", "lacks", "lacked", "lacking"), "missing; has no X"),
    (word("flaws?"), "config_error, error"),
    (word("vet", "vets", "vetted", "vetting"), "speckle_filter; check"),
    (r"\bthe usual\b|" + r"(?:_usual|\busual_)", "default"),
    (word("modest"), "check_free_memory; small"),
    (r"\b(?:goes|went|going|go) on(?: with\b| to\b|[.,;:)]|$)", "continues"),
    (r"\bas it is[.,;:)]", "unchanged; delete it"),
    (r"(?<!, )(?<!')\b(?:he|him|his)\b(?!\})", "they, the user"),
    (r"\bstands?\b(?! (?:for|in for|out)\b)(?= (?:in|at|on|there|here|beside|below|above|before|behind)\b)",
     "is in, is at"),
    (r"\bfor good\b(?! (?:reason|conditioning))", "permanently"),
    (r"\bcomes to\b(?! rest\b)", "is, amounts to, reaches"),
    (r"\ball the same\b", "still; equal"),
    (r"\bby (?:itself|themselves)\b", "alone, automatically, separately"),
    (r"\bon (?:its|their) own account\b", "without being asked"),
    (r"\bwho waits for whom\b", "threads and queues"),
    (word("knock", "knocks", "knocked"), "connect, accept"),
    (word("farewell"), "drain, close"),
    (word("owed"), "pending"),
    (word("surroundings"), "context"),
    (word("crews?"), "worker"),
    (word("scribes?"), "disk_writer"),
    (word("errands?"), "write_job, job"),
    (word("seals?", "sealed", "sealing"), "framed, with a CRC"),
    (word("evidence", "believed", "companions?"), "block_check, accepted_range, support_count; measurements, kept"),
    (word("suspects?"), "doubtful, to be checked"),
    (word("humps?"), "wide_peak"),
    (r"(?<!line of )" + word("sights?"), "observation"),
)
# Python has `is None`.
CASE_MATTERS = (
    (r"(?<!there )\b(?:is|are|was|were) none\b(?! of\b)", "is not set, is invalid, does not exist"),
)
RULES = tuple([(re.compile(text, re.IGNORECASE), instead) for text, instead in PHRASES] +
              [(re.compile(text), instead) for text, instead in CASE_MATTERS])
ANY = re.compile("|".join(f"(?:{text})" for text, _ in PHRASES), re.IGNORECASE)


def found_in(text):
    """(line number, what was found, what to write instead) of each forbidden phrase."""
    found = []
    for number, line in enumerate(text.splitlines(), 1):
        if not ANY.search(line) and " none" not in line:
            continue
        for rule, instead in RULES:
            found += [(number, match.group(), instead) for match in rule.finditer(line)]
    return found


# ---- subjects of commits
LONGEST_SUBJECT = 60
# A first word in one of these forms is not an imperative; the exceptions are.
NOT_IMPERATIVE = re.compile(r"(?:[a-z]+(?:ed|ing)|[a-z]*[a-z](?<![su])s)$")
IMPERATIVE = {"embed", "feed", "need", "speed", "shed", "seed", "exceed", "proceed", "succeed", "bring",
              "string", "ring", "spring", "bias", "alias", "canvas", "focus", "process", "express",
              "address", "access", "pass", "discuss", "compress", "suppress", "press", "miss"}


def fault_of_subject(subject):
    """What is wrong with a commit's subject, `area: imperative subject`; "" when nothing is."""
    area, colon, rest = subject.partition(": ")
    if not colon or not rest or not re.fullmatch(r"[A-Za-z0-9_./, -]+", area):
        return "has no area (expected area: imperative subject)"
    if len(subject) > LONGEST_SUBJECT:
        return f"has {len(subject)} characters (at most {LONGEST_SUBJECT})"
    first = rest.split()[0].lower()
    if first not in IMPERATIVE and NOT_IMPERATIVE.match(first):
        return f'does not start with an imperative ("{first}")'
    return ""
