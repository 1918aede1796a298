#pragma once

// Long work without Python's lock, with progress and Ctrl-C.

#include <pybind11/pybind11.h>

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

#include "rebounce/error.h"

namespace rebounce::python {

namespace py = pybind11;

/// Calls `progress`(phase, fraction) of Python at most twenty times a second, and looks for Ctrl-C
/// as often. What either raises stops the work, and is raised when it has stopped.
class LongWork {
 public:
  explicit LongWork(py::object progress) : progress_(std::move(progress)) {}

  /// The progress function of the library; on the thread that began the work.
  bool report(std::string_view phase, double fraction) {
    const auto now = std::chrono::steady_clock::now();
    if (phase == phase_ && fraction < 1 && now - last_ < std::chrono::milliseconds(50)) return true;
    last_ = now;
    phase_ = phase;
    const py::gil_scoped_acquire lock;
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (!progress_.is_none()) progress_(std::string(phase), fraction);
    } catch (py::error_already_set& error) {
      raised_.emplace(std::move(error));
      return false;
    }
    return true;
  }

  /// Returns work() without Python's lock.
  template <typename Work>
  auto run(const Work& work) {
    try {
      const py::gil_scoped_release unlocked;
      return work();
    } catch (const Cancelled&) {
      if (raised_) throw py::error_already_set(std::move(*raised_));
      throw;
    }
  }

 private:
  py::object progress_;
  std::optional<py::error_already_set> raised_;
  std::string phase_;
  std::chrono::steady_clock::time_point last_{};
};

}  // namespace rebounce::python
