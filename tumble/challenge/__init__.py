"""The hidden-effect challenge: campaigns with something hidden in them, solved without knowing, scored afterwards.

``making`` writes observations under ``campaigns/`` and, apart from them, what is true under ``truth/``; ``solving`` reads observations
only; ``scoring`` compares. Sizes of effects are drawn about the detection limits of ``limits``.
"""
