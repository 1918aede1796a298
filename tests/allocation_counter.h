#pragma once

// Replaces the allocation functions of the program that includes it (each test program is one file)
// by ones that count.

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace rebounce::test {

inline std::atomic<bool> counting_allocations = false;
inline std::atomic<int> counted_allocations = 0;

/// The number of allocations on any thread while `work` runs.
template <typename Work>
int count_allocations(const Work& work) {
  counted_allocations = 0;
  counting_allocations = true;
  work();
  counting_allocations = false;
  return counted_allocations;
}

inline void* allocate_counting(std::size_t size, std::size_t alignment) {
  if (counting_allocations) ++counted_allocations;
  void* memory = std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace rebounce::test

void* operator new(std::size_t size) {
  return rebounce::test::allocate_counting(size, alignof(std::max_align_t));
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  return rebounce::test::allocate_counting(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}
