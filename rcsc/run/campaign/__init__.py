"""Campaigns: many episodes by seed, kept in a journal, shrunk where a property does not hold.

In: a kind of episodes, a system, a seed and how many. Out: records in a journal, a summary, and counterexamples as
files. An episode's record depends on the campaign's seed, its number, and the tables and programs alone: not on how many
workers there are, nor on the order they end in.

A *journal* is a line an episode, written as each ends, so that a campaign killed at any moment goes on where it was.
A *finding* is a property that did not hold, an episode that took its process with it (*crash*), or one that did not
end (*hang*). It is *shrunk* by delta debugging: the smallest episode nearby that shows the same. Kept as a file it is
a test:

    rcsc campaign --again tests/regress/house_is_pressed_into_the_pallet.json

What an episode is, its *kind* says: how one is drawn, run, kept as text, and what can be left out of it. Episodes of any
system are those of `rcsc.run.episodes`; a plant may have its own, as that of the paper's cell has:

>>> from rcsc.run.campaign.rig import episode_seed
>>> len({episode_seed(7, 0), episode_seed(7, 1), episode_seed(8, 0)})
3

Trusted: nothing for a proof. What it costs: the episodes; shrinking one tries a bounded number of others.

Modules, in the order the data flows: `rig` (what is played on), `choose` (which kind of episodes), `journal`, `shrink`,
`work` (what a worker does), `search` (for what breaks a property, by Hypothesis), `worker_pool` (who plays), `runner` (gives out
episodes and keeps what comes back), `counterexamples`, `summary`.
"""
