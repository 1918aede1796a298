#pragma once

#include <stdexcept>
#include <string>

namespace rebounce {

/// Thrown by every Rebounce library when an input (a file, a light, a setting) cannot be used.
/// `what()` is one line that says what is wrong, where, and what to do about it. The libraries
/// neither print nor exit; see notes/contributing/conventions.md.
class Error : public std::runtime_error {
 public:
  explicit Error(const std::string& message) : std::runtime_error(message) {}
};

/// Thrown where the library was built without what a call needs.
class Unsupported : public Error {
 public:
  using Error::Error;
};

/// Thrown out of long work when the caller's progress function asked to stop. Nothing was written.
class Cancelled : public Error {
 public:
  Cancelled() : Error("stopped on request; nothing was written") {}
};

}  // namespace rebounce
