#pragma once

#include <stdexcept>
#include <string>

namespace rebounce {

/// The text with a space for each control character and none at its end. Messages quote names out
/// of files, which must not break a line or steer a terminal.
std::string one_line(std::string text);

/// Thrown by every Rebounce library when an input (a file, a light, a setting) cannot be used.
/// `what()` is one line that says what is wrong, where, and what to do about it; a message of more
/// becomes one by one_line(). The libraries
/// neither print nor exit; see notes/contributing/conventions.md.
class Error : public std::runtime_error {
 public:
  explicit Error(const std::string& message) : std::runtime_error(one_line(message)) {}
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
