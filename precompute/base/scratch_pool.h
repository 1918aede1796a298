#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace rebounce {

/// Memory that the threads of several loops use, one loop after the other. What a thread gives back
/// keeps its pages for the next one: new pages take a part of the time of short work.
template <typename Scratch>
class ScratchPool {
  struct GiveBack {
    ScratchPool* pool;
    void operator()(Scratch* scratch) const { pool->take_back(std::unique_ptr<Scratch>(scratch)); }
  };

 public:
  /// Goes back to the pool at its end. The pool must outlive it.
  using Loan = std::unique_ptr<Scratch, GiveBack>;

  /// What was given back last, or a new one. Threads may call it at the same time.
  Loan lend() {
    const std::lock_guard lock(mutex_);
    if (free_.empty()) free_.push_back(std::make_unique<Scratch>());
    Loan loan(free_.back().release(), GiveBack{this});
    free_.pop_back();
    return loan;
  }

 private:
  void take_back(std::unique_ptr<Scratch> scratch) {
    const std::lock_guard lock(mutex_);
    free_.push_back(std::move(scratch));
  }

  std::mutex mutex_;
  std::vector<std::unique_ptr<Scratch>> free_;
};

}  // namespace rebounce
