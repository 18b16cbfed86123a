"""Intraclass correlation: which share of a component's variance lies between the volumes."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from annotations.agreement.results import Reliability

_ROUNDING = 1e-24


def reliability_of(
    annotators: Sequence[str], components: Mapping[str, NDArray[np.float64]]
) -> Mapping[str, Reliability]:
    """Return the intraclass correlation of each component, over the volumes that all compared annotators did.

    Parameters
    ----------
    annotators : sequence of str
        Those who have nothing at all in a component are not among those compared in it.
    components : mapping of str to (V, A) array of float64
        See `annotations.agreement.components.component_values`, in the common frame: in frames of their own,
        volumes would not differ, and there would be no variance for the annotators to agree upon.
    """
    results = {}
    for name, values in components.items():
        compared = np.flatnonzero(~np.isnan(values).all(axis=0))
        table = values[:, compared]
        complete = ~np.isnan(table).any(axis=1) & (compared.size > 0)
        names = [annotators[who] for who in compared.tolist()]
        results[name] = intraclass_correlation(table[complete], names)
    return results


def intraclass_correlation(table: NDArray[np.float64], annotators: Sequence[str] = ()) -> Reliability:
    """Return ICC(2,1): two-way random effects, absolute agreement, single measure.

    With the mean squares of volumes MSR, annotators MSC and the rest MSE of a two-way analysis of variance,

        ICC = (MSR − MSE) / (MSR + (k − 1) MSE + k (MSC − MSE) / n)

    (P. E. Shrout, J. L. Fleiss, *Intraclass correlations*, Psychological Bulletin 86, 1979). The interval is
    from the F distribution with F. E. Satterthwaite's degrees of freedom (K. O. McGraw, S. P. Wong, *Forming
    inferences about some intraclass correlation coefficients*, Psychological Methods 1, 1996, table 7; the
    same is in Shrout and Fleiss).

    Parameters
    ----------
    table : (n, k) array of float64
        Volumes by annotators, without NaN.
    annotators : sequence of str
        Names of the k annotators.

    Returns
    -------
    Reliability
        Without a correlation for less than two volumes or annotators, and where nothing varies.
    """
    n, k = table.shape
    nothing = Reliability(n=n, annotators=tuple(annotators))
    if n < 2 or k < 2:
        return nothing
    centred = table - table.mean()
    of_volumes, of_annotators = centred.mean(axis=1), centred.mean(axis=0)
    rest = centred - of_volumes[:, np.newaxis] - of_annotators
    msr = k * float(np.sum(of_volumes**2)) / (n - 1)
    msc = n * float(np.sum(of_annotators**2)) / (k - 1)
    mse = float(np.sum(rest**2)) / ((n - 1) * (k - 1))
    if max(msr, msc, mse) <= _ROUNDING * float(np.max(table**2)):
        return nothing
    whole = msr + (k - 1) * mse + k * (msc - mse) / n
    if whole <= 0:
        return nothing
    icc = (msr - mse) / whole
    return nothing.model_copy(update={"icc": icc, "ci95": _ci95(n, k, icc, msr, msc, mse)})


def _ci95(n: int, k: int, icc: float, msr: float, msc: float, mse: float) -> tuple[float, float] | None:
    from scipy.special import fdtri

    share, rest_share = k * icc, n * (1 + (k - 1) * icc) - k * icc
    within = share * msc + rest_share * mse
    spread = (share * msc) ** 2 / (k - 1) + (rest_share * mse) ** 2 / ((n - 1) * (k - 1))
    if max(msc, mse) <= _ROUNDING * msr:
        return icc, icc
    freedom = within**2 / spread if spread > 0 else 0.0
    if not freedom > 0:
        return None
    f_low, f_high = float(fdtri(n - 1, freedom, 0.975)), float(fdtri(freedom, n - 1, 0.975))
    between = k * msc + (k * n - k - n) * mse
    if not (math.isfinite(f_low) and math.isfinite(f_high)) or between <= 0:
        return None
    low = n * (msr - f_low * mse) / (f_low * between + n * msr)
    high = n * (f_high * msr - mse) / (between + n * f_high * msr)
    # Where both are the same, rounding may turn them round.
    return min(low, high), max(low, high)
