"""Banded Cholesky factorisation A = L L^T, its solution, and the diagonal of the inverse.

Row i of the band holds A[i, i - k] in column k, then L[i, i - k], and 1 / L[i, i] in column 0. Rows
of zeros before and behind the matrix stand for what is out of it.
"""

from lariat.kernel_cache.language import ti
from lariat.perception.centerline.bandwidth import BANDWIDTH, MARGIN


@ti.func
def factorize(band: ti.template(), rhs: ti.template()):
    """Factorize in place, and overwrite the right-hand side with the solution of L y = rhs."""
    for i in range(MARGIN, band.shape[0] - MARGIN):
        row = band[i]
        residual = rhs[i]
        for k in ti.static(range(BANDWIDTH - 1)):
            column = ti.static(BANDWIDTH - 1 - k)
            total = row[0, column]
            for q in ti.static(range(column + 1, BANDWIDTH)):
                total -= row[0, q] * band[i - column][0, q - column]
            row[0, column] = total * band[i - column][0, 0]
            residual -= row[0, column] * rhs[i - column]
        total = row[0, 0]
        for q in ti.static(range(1, BANDWIDTH)):
            total -= row[0, q] * row[0, q]
        row[0, 0] = 1.0 / ti.sqrt(ti.max(total, 1e-12))
        band[i] = row
        rhs[i] = residual * row[0, 0]


@ti.func
def substitute_back(band: ti.template(), rhs: ti.template()):
    """Overwrite y with the solution of L^T x = y."""
    last = band.shape[0] - MARGIN - 1
    for r in range(band.shape[0] - 2 * MARGIN):
        i = last - r
        x = rhs[i] * band[i][0, 0]
        rhs[i] = x
        for k in ti.static(range(1, BANDWIDTH)):
            rhs[i - k] -= band[i][0, k] * x


@ti.func
def write_variances(band: ti.template(), inverse: ti.template(), variance: ti.template()):
    """Write the trace of every node's block of the inverse.

    Columns of the inverse within the band follow from those behind them (Takahashi et al. 1973):
    L^T A^-1 = L^-1 is zero above its diagonal.
    """
    last = band.shape[0] - MARGIN - 1
    for i in range(variance.shape[0]):
        variance[i] = 0.0
    for r in range(band.shape[0] - 2 * MARGIN):
        j = last - r
        scale = band[j][0, 0]
        below = ti.Vector([0.0] * BANDWIDTH, dt=ti.f64)
        for k in ti.static(range(1, BANDWIDTH)):
            below[k] = band[j + k][0, k] * scale
        square = scale * scale
        for i in ti.static(range(1, BANDWIDTH)):
            total = 0.0
            for k in ti.static(range(1, BANDWIDTH)):
                total -= below[k] * inverse[j + max(i, k)][0, abs(i - k)]
            inverse[j + i][0, i] = total
            square -= below[i] * total
        inverse[j][0, 0] = square
        variance[(j - MARGIN) // 3] += square
