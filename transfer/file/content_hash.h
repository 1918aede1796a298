#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

namespace rebounce {

/// XXH3-128 of a sequence of bytes, for telling contents apart and finding damage; not for secrets.
class ContentHash {
 public:
  static constexpr std::size_t kDigitCount = 32;

  ContentHash();
  ~ContentHash();
  ContentHash(const ContentHash&) = delete;
  ContentHash& operator=(const ContentHash&) = delete;

  /// Appends `bytes` to what is hashed; how a sequence is cut into calls makes no difference.
  void update(std::span<const std::byte> bytes);

  /// Of everything so far: "xxh3:" and 32 lower-case hexadecimal digits.
  std::string text() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace rebounce
