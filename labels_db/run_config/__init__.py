"""What a run is: an agent × a reward source × an exploration × a feedback, as frozen values.

Every variant is a class told apart by its `kind`; each package turns the class into a part through one
table. Field descriptions and bounds are the form of the dashboard and the reference of the docs.
"""

from labels_db.run_config.agents import PPO, SAC, AgentConfig
from labels_db.run_config.base import RECORDED, Config
from labels_db.run_config.environments import (
    Behaviour,
    DMControl,
    EnvironmentConfig,
    Gymnasium,
    InstalledEnvironment,
    MetaWorld,
)
from labels_db.run_config.exploration import ExplorationConfig, RandomStart, StateEntropy
from labels_db.run_config.feedback import Asking, Continuous, FeedbackConfig, NoFeedback, Sessions
from labels_db.run_config.rewards import LearnedReward, RewardConfig, TrueReward
from labels_db.run_config.run import Checkpoints, Clips, Evaluation, RunConfig
from labels_db.run_config.schemes import (
    Disagreement,
    Entropy,
    InstalledScheme,
    KCenter,
    KCenterDisagreement,
    KCenterEntropy,
    SchemeConfig,
    Uniform,
)
from labels_db.run_config.teachers import (
    Equal,
    Human,
    InstalledTeacher,
    Mistaken,
    Myopic,
    Oracle,
    Scripted,
    Skipping,
    Stochastic,
    TeacherConfig,
)

__all__ = [
    "PPO",
    "RECORDED",
    "SAC",
    "AgentConfig",
    "Asking",
    "Behaviour",
    "Checkpoints",
    "Clips",
    "Config",
    "Continuous",
    "DMControl",
    "Disagreement",
    "Entropy",
    "EnvironmentConfig",
    "Equal",
    "Evaluation",
    "ExplorationConfig",
    "FeedbackConfig",
    "Gymnasium",
    "Human",
    "InstalledEnvironment",
    "InstalledScheme",
    "InstalledTeacher",
    "KCenter",
    "KCenterDisagreement",
    "KCenterEntropy",
    "LearnedReward",
    "MetaWorld",
    "Mistaken",
    "Myopic",
    "NoFeedback",
    "Oracle",
    "RandomStart",
    "RewardConfig",
    "RunConfig",
    "SchemeConfig",
    "Scripted",
    "Sessions",
    "Skipping",
    "StateEntropy",
    "Stochastic",
    "TeacherConfig",
    "TrueReward",
    "Uniform",
]
