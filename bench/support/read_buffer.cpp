#include "bench/support/read_buffer.h"

#include <omp.h>
#include <unistd.h>

#include <algorithm>
#include <vector>

#include "bench/support/timing.h"

namespace rebounce::bench {
namespace {

/// A cache line as one value: one, two or four registers, whatever the instruction set.
using Line = std::uint64_t __attribute__((vector_size(64), may_alias));

/// Four accumulators, so that no addition waits for the one before.
__attribute__((always_inline)) inline std::uint64_t sum_lines(const Line* line, std::size_t count) {
  Line a{}, b{}, c{}, d{};
  std::size_t k = 0;
  for (; k + 4 <= count; k += 4) {
    a += line[k];
    b += line[k + 1];
    c += line[k + 2];
    d += line[k + 3];
  }
  for (; k < count; ++k) a += line[k];
  a += b + c + d;
  std::uint64_t sum = 0;
  for (int word = 0; word < 8; ++word) sum += a[word];
  return sum;
}

using SumLines = std::uint64_t (*)(const Line*, std::size_t);

std::uint64_t sum_lines_portable(const Line* line, std::size_t count) {
  return sum_lines(line, count);
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) std::uint64_t sum_lines_avx2(const Line* line, std::size_t count) {
  return sum_lines(line, count);
}

__attribute__((target("avx512f"))) std::uint64_t sum_lines_avx512(const Line* line,
                                                                  std::size_t count) {
  return sum_lines(line, count);
}
#endif

SumLines widest_sum() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f")) return sum_lines_avx512;
  if (__builtin_cpu_supports("avx2")) return sum_lines_avx2;
#endif
  return sum_lines_portable;
}

}  // namespace

ReadBuffer::ReadBuffer(std::size_t bytes)
    : lines_((bytes + sizeof(CacheLine) - 1) / sizeof(CacheLine)) {
  for (std::size_t k = 0; k < lines_.size(); ++k) lines_[k].word[0] = k;
}

void ReadBuffer::read() {
  const SumLines sum_of = widest_sum();
  std::uint64_t sum = 0;
#pragma omp parallel reduction(+ : sum)
  {
    const auto thread = static_cast<std::size_t>(omp_get_thread_num());
    const auto threads = static_cast<std::size_t>(omp_get_num_threads());
    const std::size_t begin = lines_.size() * thread / threads;
    const std::size_t end = lines_.size() * (thread + 1) / threads;
    sum += sum_of(reinterpret_cast<const Line*>(lines_.data() + begin), end - begin);
  }
  sum_ += sum;
}

double measure_memory_bandwidth() {
  constexpr std::size_t kLeast = std::size_t{256} << 20, kTimesTheCache = 4;
  constexpr int kRepeats = 7;
  // 0 or less where the system does not know.
  const long cache = sysconf(_SC_LEVEL3_CACHE_SIZE);
  const std::size_t bytes =
      std::max(kLeast, kTimesTheCache * static_cast<std::size_t>(std::max(cache, 0L)));
  ReadBuffer buffer(bytes);
  std::vector<double> seconds;
  for (int k = 0; k < kRepeats; ++k) seconds.push_back(seconds_of([&buffer] { buffer.read(); }));
  return static_cast<double>(bytes) / summarise(seconds).median;
}

}  // namespace rebounce::bench
