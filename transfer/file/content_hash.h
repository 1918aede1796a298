#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

namespace rebounce {

/// XXH3-128 of a sequence of bytes, to compare contents and detect damage. Not cryptographic.
class ContentHash {
 public:
  static constexpr std::size_t kDigitCount = 32;

  ContentHash();
  ~ContentHash();
  ContentHash(const ContentHash&) = delete;
  ContentHash& operator=(const ContentHash&) = delete;

  /// Appends `bytes`. The hash does not depend on how a sequence is divided into calls.
  void update(std::span<const std::byte> bytes);

  /// The hash of all bytes so far: "xxh3:" and 32 lower-case hexadecimal digits.
  std::string text() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace rebounce
