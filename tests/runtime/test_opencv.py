"""OpenCV's threads, bounded and given back."""

from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import cv2
import pytest

from relit.runtime.opencv import one_opencv_thread


@pytest.fixture
def two_threads():
    before = cv2.getNumThreads()
    cv2.setNumThreads(2)
    yield
    cv2.setNumThreads(before)


@pytest.mark.usefixtures("two_threads")
def test_the_last_to_leave_gives_them_back():
    both = Barrier(2)

    def inside(_):
        with one_opencv_thread():
            both.wait(120)
            return cv2.getNumThreads()

    with ThreadPoolExecutor(2) as executor:
        assert list(executor.map(inside, range(2))) == [1, 1]
    assert cv2.getNumThreads() == 2


@pytest.mark.usefixtures("two_threads")
def test_they_are_given_back_after_an_error():
    with pytest.raises(ZeroDivisionError), one_opencv_thread():
        _ = 1 / 0
    assert cv2.getNumThreads() == 2
