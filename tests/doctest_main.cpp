// SPDX-License-Identifier: Apache-2.0
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include <cstdio>

#include "synthetic/seed.hpp"

namespace {

/// Prints the seed of random tests beside each failure and crash.
class SeedPrinter : public doctest::IReporter {
  public:
    explicit SeedPrinter(const doctest::ContextOptions &) {}
    void log_assert(const doctest::AssertData &assertion) override {
        if (assertion.m_failed) {
            print();
        }
    }
    void test_case_exception(const doctest::TestCaseException &) override { print(); }
    void report_query(const doctest::QueryData &) override {}
    void test_run_start() override {}
    void test_run_end(const doctest::TestRunStats &) override {}
    void test_case_start(const doctest::TestCaseData &) override {}
    void test_case_reenter(const doctest::TestCaseData &) override {}
    void test_case_end(const doctest::CurrentTestCaseStats &) override {}
    void subcase_start(const doctest::SubcaseSignature &) override {}
    void subcase_end() override {}
    void log_message(const doctest::MessageData &) override {}
    void test_case_skipped(const doctest::TestCaseData &) override {}

  private:
    static void print() {
        std::printf("VERGENCE_SEED=%llu\n",
                    static_cast<unsigned long long>(synthetic::test_seed()));
    }
};

}  // namespace

REGISTER_LISTENER("seed", 1, SeedPrinter);
