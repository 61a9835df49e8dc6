from dockpose.sources.rtp.assembly import Assembly
from dockpose.sources.rtp.packets import Packet
from dockpose.sources.rtp.payload import H264, Jpeg

KEY, INTER = (b"\x67s", b"\x68p", b"\x65k"), (b"\x41a", b"\x41b")


def pictures(assembly: Assembly, *arrivals: tuple[tuple[bytes, ...], set[int]], stamp: int = 0) -> list[bool]:
    """Whether each picture, of units of which some are lost, is whole."""
    found = [0] * len(arrivals)
    is_after_gap = False
    for number, (units, lost) in enumerate(arrivals):
        for place, unit in enumerate(units):
            if place in lost:
                is_after_gap = True
                continue
            packet = Packet(0, (stamp + 3000 * number) % 2**32, 1, 96, place == len(units) - 1, unit)
            for whole in assembly.take(packet, is_after_gap):
                found[round(whole.sent_s * 30)] += 1
            is_after_gap = False
    assert max(found) <= 1
    return [bool(count) for count in found]


def test_nothing_is_whole_before_the_first_key_that_was_there_from_its_beginning():
    seen = pictures(Assembly(H264()), (INTER, {0}), (INTER, set()), (KEY, set()), (INTER, set()))
    assert seen == [False, False, True, True]


def test_a_key_that_was_joined_in_its_middle_is_not_whole():
    assert pictures(Assembly(H264()), (KEY, set()), (KEY, set())) == [False, True]


def test_after_a_lost_packet_nothing_is_whole_until_the_next_key():
    key, inter = (KEY, set()), (INTER, set())
    assembly = Assembly(H264())
    assert pictures(assembly, inter, key, inter, (INTER, {0}), inter, key, inter) == [
        *(False, True, True),
        *(False, False, True, True),
    ]
    assert assembly.left_out == 3  # with the one that was joined in its middle


def test_a_lost_last_packet_spoils_its_picture_and_the_next():
    key, inter = (KEY, set()), (INTER, set())
    assert pictures(Assembly(H264()), inter, key, (INTER, {1}), inter, key) == [False, True, False, False, True]


def test_a_lost_picture_spoils_those_that_need_it():
    key, inter = (KEY, set()), (INTER, set())
    assert pictures(Assembly(H264()), inter, key, (INTER, {0, 1}), inter, key)[2:] == [False, False, True]


def test_the_first_key_after_a_loss_begins_and_no_other():
    assembly, found = Assembly(H264()), []
    for number, unit in enumerate([b"\x41a", *KEY, b"\x41b", *KEY]):
        packet = Packet(
            number, 0 if number == 0 else 3000 * ((number + 3) // 4), 1, 96, unit in (b"\x41a", b"\x41b", KEY[2]), unit
        )
        found += assembly.take(packet, False)
    assert [(whole.is_key, whole.begins) for whole in found] == [(True, True), (False, False), (True, False)]


def test_each_jpeg_stands_for_itself():
    def parts(first: int) -> tuple[bytes, ...]:
        return tuple(bytes([0, 0, 0, at, 1, 50, 2, 2]) + b"scan" for at in (0, 4))

    whole = (parts(0), set[int]())
    seen = pictures(Assembly(Jpeg()), whole, (parts(1), {0}), whole, (parts(3), {1}), whole)
    assert seen == [True, False, True, False, True]


def test_times_go_on_where_the_stamps_of_32_bits_begin_anew():
    key = (KEY, set[int]())
    seen = pictures(Assembly(H264()), (INTER, set()), key, key, key, stamp=2**32 - 4000)
    assert seen == [False, True, True, True]


def test_a_sender_that_marks_no_ends_is_understood_a_picture_later():
    assembly, found = Assembly(H264()), []
    for number, units in enumerate([INTER, KEY, INTER, INTER]):
        for unit in units:
            found += [
                (number, whole.is_key) for whole in assembly.take(Packet(0, 3000 * number, 1, 96, False, unit), False)
            ]
    assert found == [(2, True), (3, False)]


def test_a_picture_that_cannot_be_decoded_is_as_one_that_is_lost():
    assembly = Assembly(H264())
    key, inter = (KEY, set()), (INTER, set())
    assert pictures(assembly, inter, key, inter) == [False, True, True]
    assembly.spoil()
    found = []
    for number, units in enumerate([INTER, KEY]):
        for place, unit in enumerate(units):
            found += assembly.take(Packet(0, 9000 + 3000 * number, 1, 96, place == len(units) - 1, unit), False)
    assert [whole.begins for whole in found] == [True]
