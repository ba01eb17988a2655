"""Products with the Hessian of a self-contact, for the linear solves.

A contact couples nodes that are far apart in the band. Its Hessian c u u^T + G is therefore applied
to displacements from its `SelfContact` numbers: u holds the normal at the four nodes of both edges,
weighted by the places of the points along them.
"""

from lariat.kernel_cache.language import ti
from lariat.rod.kernels.memory import add, load3
from lariat.rod.launch.layout import SelfContact


@ti.func
def normal_separation(w: ti.template(), entry, d):
    """Derivative of the distance of a contact along a displacement `d` of all blocks: u d."""
    return load3(w, entry + SelfContact.NORMAL).dot(separation(w, entry, d))


@ti.func
def separation(w: ti.template(), entry, d):
    """Relative displacement of the two points of a contact, for blocks moved by `d`."""
    first = d + 6 * ti.cast(w[entry + SelfContact.EDGE], ti.i32)
    other = d + 6 * ti.cast(w[entry + SelfContact.OTHER_EDGE], ti.i32)
    s, t = w[entry + SelfContact.PLACE], w[entry + SelfContact.OTHER_PLACE]
    here = (1.0 - s) * load3(w, first) + s * load3(w, first + 6)
    there = (1.0 - t) * load3(w, other) + t * load3(w, other + 6)
    return here - there


@ti.func
def geometric_hessian_product(w: ti.template(), entry, d):
    """Product of the geometric part of a contact's Hessian with `d`: at the points, and at nodes.

    The Hessian of a contact is c u u^T plus this part: the force f turns with the line between the
    points, and the nearer point of the other edge slides along it. With the normal n, the direction
    e and length L of the other edge, the distance r, P = I - n n^T and the separation v, it is
    -f (P v / r + q e) at the points, and f q r / L n with opposite signs at the nodes of the other
    edge, where q = n (d_j - d_j+1) / L - e v / r.
    """
    moved = separation(w, entry, d)
    normal = load3(w, entry + SelfContact.NORMAL)
    along = load3(w, entry + SelfContact.OTHER_DIRECTION)
    inverse_length = w[entry + SelfContact.OTHER_INVERSE_LENGTH]
    distance, force = w[entry + SelfContact.DISTANCE], w[entry + SelfContact.FORCE]
    other = d + 6 * ti.cast(w[entry + SelfContact.OTHER_EDGE], ti.i32)
    lean = normal.dot(load3(w, other) - load3(w, other + 6))
    slide = inverse_length * lean - along.dot(moved) / distance
    tangential = moved - normal.dot(moved) * normal
    return -force * (
        tangential / distance + slide * along
    ), force * slide * distance * inverse_length * normal


@ti.func
def subtract_at_nodes(w: ti.template(), entry, to, at_points, at_other):
    """Subtract a product of `geometric_hessian_product` from the blocks of `to`."""
    first = to + 6 * ti.cast(w[entry + SelfContact.EDGE], ti.i32)
    other = to + 6 * ti.cast(w[entry + SelfContact.OTHER_EDGE], ti.i32)
    s, t = w[entry + SelfContact.PLACE], w[entry + SelfContact.OTHER_PLACE]
    add(w, first, (s - 1.0) * at_points)
    add(w, first + 6, -s * at_points)
    add(w, other, (1.0 - t) * at_points - at_other)
    add(w, other + 6, t * at_points + at_other)
