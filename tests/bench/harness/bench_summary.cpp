// SPDX-License-Identifier: Apache-2.0
#include "bench/harness/bench_summary.hpp"

#include <algorithm>
#include <map>

namespace {

using by_method = std::map<std::string, const bench_outcome *>;

double bad_1px_of(const bench_outcome &one) {
    return one.error.all.filled_visible.bad_percent[1];
}

bool better_than_all_opencv(const bench_outcome &one, const by_method &rivals) {
    return std::all_of(rivals.begin(), rivals.end(), [&](const auto &rival) {
        return rival.second->is_ours || bad_1px_of(one) < bad_1px_of(*rival.second);
    });
}

void append(std::vector<double> &to, const std::vector<double> &from) {
    to.insert(to.end(), from.begin(), from.end());
}

void add_errors(const std::vector<const bench_outcome *> &outcomes,
                const std::map<std::string, by_method> &by_pair, bench_summary &sum) {
    for (const bench_outcome *one : outcomes) {
        if (!one->has_truth) {
            continue;
        }
        sum.pairs++;
        sum.bad_1px += bad_1px_of(*one);
        sum.bad_2px += one->error.all.filled_visible.bad_percent[2];
        for (const auto &[kept, from] : {std::pair(&sum.visible, &one->error.visible),
                                         std::pair(&sum.known, &one->error.known)}) {
            kept->density_percent += from->density_percent;
            kept->bad_3px_percent += from->bad_3px_percent;
        }
        const by_method &rivals = by_pair.at(one->pair);
        const auto plain = rivals.find(bench_plain_mode);
        if (plain != rivals.end()) {
            sum.against_plain++;
            sum.better_than_plain += bad_1px_of(*one) < bad_1px_of(*plain->second) ? 1 : 0;
        }
        sum.better_than_all += better_than_all_opencv(*one, rivals) ? 1 : 0;
    }
    if (sum.pairs > 0) {
        for (double *value : {&sum.bad_1px, &sum.bad_2px, &sum.visible.density_percent,
                              &sum.visible.bad_3px_percent, &sum.known.density_percent,
                              &sum.known.bad_3px_percent}) {
            *value /= sum.pairs;
        }
    }
}

void add_costs(const std::vector<const bench_outcome *> &outcomes, bench_summary &sum) {
    std::vector<double> speedups;
    for (const bench_outcome *one : outcomes) {
        sum.worst_of_allowance_percent = std::max(sum.worst_of_allowance_percent,
                                                  100 * static_cast<double>(one->memory_bytes) /
                                                      static_cast<double>(one->allowance_bytes()));
        append(speedups, one->speedups);
    }
    sum.speedup = bench_spread_of(speedups);
    for (const bench_group &group : bench_groups) {
        std::vector<double> ratios, cpu_ratios;
        bench_group_time time{&group, 0, {}, {}};
        for (const bench_outcome *one : outcomes) {
            const auto single = one->times.find(1);
            if (single != one->times.end() && one->disparities >= group.min &&
                one->disparities <= group.max) {
                time.pairs++;
                append(ratios, single->second.ratios);
                append(cpu_ratios, single->second.cpu_ratios);
            }
        }
        if (time.pairs > 0) {
            time.ratio = bench_spread_of(ratios);
            time.cpu_ratio = bench_spread_of(cpu_ratios);
            sum.times.push_back(time);
        }
    }
}

}  // namespace

std::vector<bench_summary> bench_summaries(const std::vector<bench_outcome> &all) {
    std::vector<std::string> order;
    std::map<std::string, std::vector<const bench_outcome *>> outcomes;
    std::map<std::string, by_method> by_pair;
    for (const bench_outcome &one : all) {
        if (outcomes.find(one.method) == outcomes.end()) {
            order.push_back(one.method);
        }
        outcomes[one.method].push_back(&one);
        by_pair[one.pair][one.method] = &one;
    }
    std::vector<bench_summary> result;
    for (const std::string &name : order) {
        bench_summary sum;
        sum.method = name;
        sum.is_ours = outcomes[name].front()->is_ours;
        add_errors(outcomes[name], by_pair, sum);
        add_costs(outcomes[name], sum);
        result.push_back(sum);
    }
    const auto best_mode = std::find_if(result.begin(), result.end(), [](const auto &sum) {
        return sum.method == bench_best_mode && sum.bad_1px > 0;
    });
    if (best_mode != result.end()) {
        const double bad_1px = best_mode->bad_1px;
        for (bench_summary &sum : result) {
            sum.to_best_mode = sum.bad_1px / bad_1px;
        }
    }
    return result;
}
