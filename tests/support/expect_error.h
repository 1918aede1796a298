#pragma once

#include <gtest/gtest.h>

#include <string>

#include "rebounce/error.h"

namespace rebounce::test {

/// What an Error that `action` throws says; fails the test when there is none or it is not one
/// line.
template <typename Action>
std::string error_of(Action&& action) {
  try {
    action();
  } catch (const Error& error) {
    std::string text = error.what();
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
    return text;
  }
  ADD_FAILURE() << "no Error was thrown";
  return {};
}

template <typename Action>
void expect_error(Action&& action, const std::string& part) {
  const std::string text = error_of(action);
  EXPECT_NE(text.find(part), std::string::npos) << "'" << text << "' lacks '" << part << "'";
}

}  // namespace rebounce::test
