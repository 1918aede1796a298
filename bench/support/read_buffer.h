#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace rebounce::bench {

/// The ceiling for an apply: reading as many bytes, every cache line once and nothing else, with
/// the widest loads that the processor has, on all OpenMP threads.
class ReadBuffer {
 public:
  /// A buffer of `bytes`, rounded up to whole cache lines.
  explicit ReadBuffer(std::size_t bytes);

  void read();

 private:
  struct alignas(64) CacheLine {
    std::uint64_t word[8];
  };

  std::vector<CacheLine> lines_;
  std::uint64_t sum_ = 0;  ///< of all words: what is not used need not be read
};

/// Bytes per second at which a buffer is read that no cache holds, several times as large as the
/// last of them, on all OpenMP threads: the median of a few times.
double measure_memory_bandwidth();

}  // namespace rebounce::bench
