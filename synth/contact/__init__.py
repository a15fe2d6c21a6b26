"""Impacts of a true mesh on a plate: a compliant contact at every corner, integrated in steps of nanoseconds."""

from synth.contact.chipping import chipped
from synth.contact.collision import Collision, collide
from synth.contact.law import ContactLaw, contact_law
from synth.contact.touching import first_touch

__all__ = ["Collision", "ContactLaw", "chipped", "collide", "contact_law", "first_touch"]
