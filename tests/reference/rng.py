"""xoshiro256++ (Blackman and Vigna 2021) in whole numbers of any size, and the draws that learners make."""

import numpy as np

MASK = 2**64 - 1


def rotate_left(x: int, k: int) -> int:
    return ((x << k) | (x >> (64 - k))) & MASK


class Stream:
    """One stream: child `agent` of a seed."""

    def __init__(self, seed: int, agent: int) -> None:
        self.words = [int(w) for w in np.random.SeedSequence(seed).spawn(agent + 1)[agent].generate_state(4, np.uint64)]

    def next_word(self) -> int:
        s = self.words
        result = (rotate_left((s[0] + s[3]) & MASK, 23) + s[0]) & MASK
        t = (s[1] << 17) & MASK
        s[2] ^= s[0]
        s[3] ^= s[1]
        s[1] ^= s[2]
        s[0] ^= s[3]
        s[2] ^= t
        s[3] = rotate_left(s[3], 45)
        return result

    def uniform(self) -> float:
        """The upper 53 bits as a fraction."""
        return (self.next_word() >> 11) / 2**53

    def below(self, n: int) -> int:
        return int(self.uniform() * n)

    def choice(self, candidates: list[int]) -> int:
        """One of several; nothing is drawn where there is nothing to choose."""
        return candidates[0] if len(candidates) == 1 else candidates[self.below(len(candidates))]
