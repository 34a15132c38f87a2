import numpy as np

from pipelines.estimation.collinearity import collinearities, profiled


def gram(*columns):
    A = np.column_stack(columns)
    return A.T @ A


def test_a_spring_and_inertia_on_one_sine_are_collinear():
    """On q = sin wt the acceleration is -w² q: the published hip trajectory's trouble."""
    t = np.linspace(0, 10, 2001)
    w = 2 * np.pi / 10
    q = np.sin(w * t)
    acceleration = -(w**2) * q + 1e-3 * np.sin(3 * w * t)
    sentences = collinearities(gram(acceleration, q, np.cos(w * t)), ["X1", "spring", "viscous"])
    assert len(sentences) == 1
    assert sentences[0].startswith("this motion hardly separates X1 and spring (condition index ")


def test_columns_well_apart_raise_no_word():
    t = np.linspace(0, 10, 2001)
    assert collinearities(gram(np.sin(t), np.cos(t), np.sin(3 * t)), ["a", "b", "c"]) == []


def test_units_do_not_make_a_collinearity():
    t = np.linspace(0, 10, 2001)
    assert collinearities(gram(1e6 * np.sin(t), 1e-6 * np.cos(t)), ["a", "b"]) == []


def test_information_with_other_parameters_unknown_is_the_inverse_of_the_covariance():
    whole = gram(*np.random.default_rng(3).normal(size=(5, 200)))
    kept, others = [0, 2, 4], np.array([1, 3])
    covariance = np.linalg.inv(whole)[np.ix_(kept, kept)]
    np.testing.assert_allclose(profiled(whole, others), np.linalg.inv(covariance), rtol=1e-9)
