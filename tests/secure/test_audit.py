"""What the audit reads in Zenoh's log: lines as a router with an access list prints them."""

from swarm.bus.audit import NAMED, Audit

WHERE = "2026-11-22T20:33:03.509831Z TRACE  rx-1 ThreadId({thread}) zenoh::net::routing::interceptor::access_control: "
ON = "{zid} on Interface(lo)+CertCommonName({name})+Transport(Tls)+{zid} is unauthorized to {action} ({flow}) on {key}"


def line(text: str, thread: str = "09") -> str:
    return WHERE.format(thread=thread) + text + "\n"


def on(name: str, action: str, key: str, flow: str = "ingress") -> str:
    return ON.format(zid="114fb6" if name == "r1" else "a8fdd8", name=name, action=action, key=key, flow=flow)


def heard(*lines: str) -> list[str]:
    said: list[str] = []
    audit = Audit(said.append)
    for one in lines:
        audit.read(one)
    audit.close()
    return said


def test_who_tried_is_named_once_and_counted() -> None:
    assert heard(*[line(on("r1", "Put", "a/b"))] * 3, line(on("watcher", "Query", "a/c"))) == [
        "refused: r1: put on 'a/b'",
        "refused: watcher: query on 'a/c'",
        "refused 3 times: r1: put on 'a/b'",
    ]


def test_what_is_looked_up_for_a_declared_key_was_not_tried() -> None:
    looked_up = [line(on("r1", action, "a/b")) for action in ("Query", "Reply", "Put", "Declare/Undeclare Queryable")]
    begin = line("ACL (ingress): caching permissions for `a/b` ...")
    used = line("Using cached result: 114fb6 is unauthorized to Put (ingress) on a/b")
    assert heard(begin, *looked_up) == []
    assert heard(begin, *looked_up, used) == ["refused: r1: put on 'a/b'"]
    assert heard(begin, *looked_up, line(on("r1", "Put", "a/b"))) == ["refused: r1: put on 'a/b'"], "tried afterwards"
    outwards = line("ACL (egress): caching permissions for `a/b` ...")
    assert heard(begin, *looked_up, outwards, line(on("watcher", "Delete", "a/b"))) == [
        "refused: watcher: delete on 'a/b'"
    ]
    assert heard(begin, line(on("r1", "Put", "a/b"), thread="10")) == ["refused: r1: put on 'a/b'"], "another thread"


def test_what_is_allowed_or_leaves_the_router_is_left_out() -> None:
    allowed = on("r1", "Put", "a/b").replace("unauthorized", "authorized")
    assert (
        heard(line(allowed), line(on("r1", "Delete", "a/b", "egress")), line("Access control is enabled"), "\n") == []
    )


def test_who_has_no_certificate_is_told() -> None:
    text = "2026-11-22T20:33:04.013392Z  WARN acc-0 ThreadId(05) zenoh_link_tls::unicast: peer sent no certificates. Hint: increase the limit."
    assert heard(text) == ["refused: somebody: connect: 'peer sent no certificates'"]


def test_colours_and_line_breaks_do_not_reach_the_terminal() -> None:
    coloured = line(on("r1", "Put", "a/\x07b")).replace("TRACE", "\x1b[35mTRACE\x1b[0m")
    assert heard(coloured) == ["refused: r1: put on 'a/\\x07b'"]


def test_a_line_break_in_a_key_makes_no_record_of_its_own() -> None:
    forged = line(on("r1", "Put", "a/\n" + line(on("watcher", "Put", "a/b"))))
    assert [one[:20] for one in heard(forged)] == ["refused: r1: put on "]
    assert (
        heard(
            line(on("r1", "Put", "a/\n" + line(on("watcher", "Put", "a/b")))).replace("unauthorized", "authorized", 1)
        )
        == []
    )


def test_a_flood_of_different_keys_is_only_counted() -> None:
    said = heard(*(line(on("r1", "Put", f"a/{number}")) for number in range(NAMED + 5)))
    assert len(said) == NAMED + 1
    assert said[-1].startswith("refused 5 times: more than")
