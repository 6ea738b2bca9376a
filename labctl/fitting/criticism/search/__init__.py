"""Search for what is missing: shapes refined, causes found one after the other, each checked before it is named."""
