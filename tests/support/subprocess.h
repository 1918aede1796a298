#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace rebounce::test {

struct Outcome {
  int exit_code = -1;  ///< -1: ended by a signal
  std::string out, err;
};

/// A program that runs beside the test, without standard input; what it prints goes into
/// files `out` and `err`. Killed if it is still there in the end.
class Subprocess {
 public:
  Subprocess(std::vector<std::string> command, std::filesystem::path out, std::filesystem::path err)
      : out_(std::move(out)), err_(std::move(err)) {
    std::vector<char*> arguments;
    for (std::string& word : command) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    process_ = ::fork();
    if (process_ != 0) return;
    redirect(STDIN_FILENO, "/dev/null", O_RDONLY);
    redirect(STDOUT_FILENO, out_.c_str(), O_WRONLY | O_CREAT | O_TRUNC);
    redirect(STDERR_FILENO, err_.c_str(), O_WRONLY | O_CREAT | O_TRUNC);
    ::execv(arguments[0], arguments.data());
    ::_exit(127);
  }
  ~Subprocess() {
    if (process_ <= 0) return;
    ::kill(process_, SIGKILL);
    ::waitpid(process_, nullptr, 0);
  }
  Subprocess(const Subprocess&) = delete;
  Subprocess& operator=(const Subprocess&) = delete;

  void send(int signal_number) { ::kill(process_, signal_number); }

  /// Waits until the program has printed `text` on standard error; false if it has not in a minute.
  bool has_said(const std::string& text) const {
    for (int tries = 0; tries < 6000; ++tries) {
      if (read_bytes(err_).find(text) != std::string::npos) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }

  /// Waits for the end. Call it once.
  Outcome finish() {
    int status = 0;
    EXPECT_EQ(::waitpid(process_, &status, 0), process_);
    process_ = -1;
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_bytes(out_), read_bytes(err_)};
  }

 private:
  static void redirect(int descriptor, const char* path, int flags) {
    const int opened = ::open(path, flags, 0600);
    if (opened < 0 || ::dup2(opened, descriptor) < 0) ::_exit(126);
    ::close(opened);
  }

  std::filesystem::path out_, err_;
  pid_t process_ = -1;
};

}  // namespace rebounce::test
