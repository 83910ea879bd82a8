"""Adapters: they make problems of Gymnasium's and PettingZoo's environments."""
